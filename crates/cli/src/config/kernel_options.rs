//! Converts the settings of `[label]` to options of the kernel.

use super::{Attribute, LabelConfig};
use partprobe_brep::{AttributeChoice, ReadBudget, TessellationOptions};
use partprobe_verify::MeasureSettings;

impl LabelConfig {
    /// The options for tessellating a B-Rep.
    pub(crate) fn shape_options(&self) -> TessellationOptions {
        TessellationOptions {
            chord_fraction: self.chord_fraction,
            angle_rad: self.angle_rad,
            attributes: attribute_choice(&self.attributes),
            volume_loss: self.volume_loss,
            max_triangles: self.max_triangles,
            solid_volumes: false,
        }
    }

    /// The limits for reading a file.
    pub(crate) fn read_budget(&self) -> ReadBudget {
        ReadBudget {
            max_bytes: self.max_file_mb << 20,
            max_entities: self.max_entities,
            ..ReadBudget::default()
        }
    }

    /// The settings with which `inspect`, `extract` and `verify` measure a file.
    pub(crate) fn measure_settings(&self) -> MeasureSettings {
        MeasureSettings {
            theta_deg: self.theta_deg,
            options: self.shape_options(),
            budget: self.read_budget(),
        }
    }
}

fn attribute_choice(attributes: &[Attribute]) -> AttributeChoice {
    let has = |attribute: Attribute| attributes.contains(&attribute);
    AttributeChoice {
        normal: has(Attribute::Normal),
        uv: has(Attribute::Uv),
        curvature: has(Attribute::Curvature),
    }
}
