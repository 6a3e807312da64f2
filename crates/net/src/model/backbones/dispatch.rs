//! Generates the code that is the same for every backbone: three enums over the list, and one match per function.
//!
//! The macro is called once, in the parent module, with the list of backbones.

/// Makes the enums over all backbones, and passes each call on to the backbone that a config chooses.
macro_rules! backbones {
    ($($(#[doc = $doc:literal])* $type:literal: $module:ident::{$name:ident, $config:ident};)+) => {
        $(
            use $module::$name;
            pub use $module::$config;
        )+

        /// The choice of a backbone. In TOML it is a table with the key `type`.
        #[derive(Clone, Debug, PartialEq, ::serde::Deserialize, ::serde::Serialize)]
        #[serde(tag = "type", deny_unknown_fields)]
        pub enum BackboneConfig {
            $(
                $(#[doc = $doc])*
                #[serde(rename = $type)]
                $name($config),
            )+
        }

        /// A backbone of any kind.
        #[derive(Module, Debug)]
        pub(crate) enum AnyBackbone {
            $($name($name),)+
        }

        /// The input of a backbone of any kind.
        pub(crate) enum ShapeInput {
            $($name(<$name as Backbone>::Input),)+
        }

        impl BackboneConfig {
            /// The `type` of every backbone, in the order in which they are listed.
            pub const TYPES: &[&str] = &[$($type),+];

            /// The `type` in a config.
            #[must_use]
            pub fn type_name(&self) -> &'static str {
                match self {
                    $(Self::$name(_) => $type,)+
                }
            }

            /// Refuses settings that no network can have.
            ///
            /// # Errors
            /// If a value is out of its range.
            pub(crate) fn check(&self) -> Result<(), ConfigError> {
                match self {
                    $(Self::$name(config) => BackboneSettings::check(config),)+
                }
            }

            /// Depths and widths of the stages.
            #[must_use]
            pub fn stages(&self) -> Stages {
                match self {
                    $(Self::$name(config) => BackboneSettings::stages(config),)+
                }
            }

            /// The named sizes of this kind of backbone, beginning with the smallest. The other settings are those of `self`.
            #[must_use]
            pub fn named_sizes(&self) -> Vec<(&'static str, Self)> {
                match self {
                    $(Self::$name(config) => BackboneSettings::named_sizes(config)
                        .into_iter()
                        .map(|(name, config)| (name, Self::$name(config)))
                        .collect(),)+
                }
            }

            /// Whether the shapes of a batch must go through the network together.
            pub(crate) fn runs_batch_as_one(&self) -> bool {
                match self {
                    $(Self::$name(config) => BackboneSettings::runs_batch_as_one(config),)+
                }
            }

            /// The curves of each level at test time.
            pub(crate) fn test_orders(&self) -> CurveOrders {
                match self {
                    $(Self::$name(config) => BackboneSettings::test_orders(config),)+
                }
            }

            /// The curves of each level for one training step.
            pub(crate) fn training_orders(&self, rng: &mut Rng) -> CurveOrders {
                match self {
                    $(Self::$name(config) => BackboneSettings::training_orders(config, rng),)+
                }
            }

            /// Turns the tokens of one shape into the input of the network.
            pub(crate) fn prepare(&self, tokens: &Tokens, orders: &CurveOrders) -> ShapeInput {
                match self {
                    $(Self::$name(config) => {
                        ShapeInput::$name(<$name as Backbone>::prepare(config, tokens, orders))
                    })+
                }
            }
        }

        impl AnyBackbone {
            pub(crate) fn new(init: &Initializer, config: &BackboneConfig) -> Self {
                match config {
                    $(BackboneConfig::$name(config) => {
                        Self::$name(<$name as Backbone>::new(init, config))
                    })+
                }
            }

            /// Passes the shapes through the network. All inputs must be of its own kind.
            pub(crate) fn forward(
                &self,
                shapes: &[&ShapeInput],
                device: &Device,
                mode: &mut ForwardMode,
            ) -> Tensor<2> {
                match self {
                    $(Self::$name(backbone) => {
                        let inputs: Vec<_> = shapes
                            .iter()
                            .filter_map(|shape| match shape {
                                ShapeInput::$name(input) => Some(input),
                                _ => None,
                            })
                            .collect();
                        Backbone::forward(backbone, &inputs, device, mode)
                    })+
                }
            }
        }
    };
}

pub(super) use backbones;
