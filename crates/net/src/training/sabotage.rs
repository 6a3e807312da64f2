//! Defects on purpose: what each [`Sabotage`] does to labels, loss and gradients.
//!
//! A run whose expectations hold under one of them expects too little.

use crate::config::Sabotage;
use crate::loss::Loss;
use carrier::keyed_rng;
use rand::Rng as _;

impl Sabotage {
    /// Deals the labels out to other tokens; each has as many as before.
    pub(super) fn deal_out(self, labels: &mut [i32], shape: &str) {
        if self != Self::ShuffleLabels {
            return;
        }
        let rng = &mut keyed_rng(0, &["sabotage", shape]);
        for last in (1..labels.len()).rev() {
            labels.swap(last, (rng.next_u64() % (last as u64 + 1)) as usize);
        }
    }

    /// Turns the loss around.
    pub(super) fn flip(self, loss: &mut Loss) {
        if self == Self::FlipLoss {
            loss.terms.total = -loss.terms.total;
            loss.gradient.iter_mut().for_each(|g| *g = -*g);
        }
    }

    /// Whether the tensor of this name keeps its initial values.
    pub(crate) fn freezes(self, tensor: &str) -> bool {
        self == Self::FreezeEncoder && !tensor.starts_with("head.")
    }

    /// Whether no gradient reaches the tensor of this name.
    pub(crate) fn cuts_off(self, tensor: &str) -> bool {
        match self {
            Self::ZeroBlockGradient => tensor.contains("encoder.0.blocks.0."),
            Self::FreezeEncoder => self.freezes(tensor),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Backend;
    use crate::model::Model;
    use crate::parameters;
    use crate::planted::net;

    #[test]
    fn the_names_that_are_cut_off_are_those_of_the_network() {
        let model = Model::init(&net(), 0, Backend::Flex).unwrap();
        let shapes = parameters::shapes(model.network());
        let n_cut = |sabotage: Sabotage| shapes.iter().filter(|shape| sabotage.cuts_off(&shape.name)).count();
        assert_eq!(n_cut(Sabotage::None), 0);
        assert_eq!(n_cut(Sabotage::FreezeEncoder), shapes.len() - 2);
        let of_a_block = n_cut(Sabotage::ZeroBlockGradient);
        assert!(0 < of_a_block && of_a_block < shapes.len() / 2, "{of_a_block} of {}", shapes.len());
    }

    #[test]
    fn dealt_labels_are_the_same_ones() {
        let labels: Vec<i32> = (0..50).map(|k| k / 10).collect();
        let mut dealt = labels.clone();
        Sabotage::None.deal_out(&mut dealt, "a");
        assert_eq!(dealt, labels);
        Sabotage::ShuffleLabels.deal_out(&mut dealt, "a");
        assert_ne!(dealt, labels);
        dealt.sort_unstable();
        assert_eq!(dealt, labels);
    }
}
