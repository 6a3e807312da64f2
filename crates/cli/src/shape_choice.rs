//! Chooses the measured shapes of a data set: all of them, or a number of different ones in a random order that depends on a
//! seed.
//!
//! The choice depends on the seed and on the ids of the shapes. It does not depend on the order of the data set or on the number
//! of threads, so two commands with the same arguments measure the same shapes.

use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::shape_input::ShapeInput;
use crate::shape_loop::for_each_measured;
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_carrier::{Carrier, signature_of_carrier};
use partprobe_eval::{DistinctShapes, Duplicate, seeded_rank};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The number of carriers that are read at once while shapes are chosen.
const READ_AT_ONCE: usize = 64;

/// The arguments that choose the measured shapes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ChoiceArgs {
    /// Measure this number of different shapes, which --seed chooses; all shapes if not given.
    #[arg(long, value_name = "N")]
    shapes: Option<usize>,
    /// Use only shapes with at least this number of STEP parts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    min_parts: usize,
    /// Use only shapes with at most this number of STEP parts.
    #[arg(long, value_name = "N")]
    max_parts: Option<usize>,
    /// The seed of the choice of shapes, the points, the sources and the intervals.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
}

/// The chosen shapes, by their ids, and the reasons why others were not chosen.
pub(crate) struct ChosenShapes<'a> {
    pub(crate) shapes: Vec<&'a ShapeInput>,
    pub(crate) left_out: BTreeMap<&'static str, usize>,
}

impl ChosenShapes<'_> {
    /// Measures every shape on the threads of the current pool, `at_once` of them before the next ones are started.
    ///
    /// The results are in the order of the shapes' ids, for any speed of the threads. A bar on stderr is named `verb`.
    ///
    /// # Errors
    /// If the user stops the program.
    pub(crate) fn measured<T: Send>(
        &self,
        verb: &str,
        at_once: usize,
        interrupt: &Interrupt,
        measure: impl Fn(&ShapeInput) -> T + Sync,
    ) -> Result<Vec<T>> {
        let progress = Progress::on_terminal();
        self.notes().iter().for_each(|note| progress.note(note));

        let mut all = Vec::with_capacity(self.shapes.len());
        let take = |found| all.push(found);
        for_each_measured(&self.shapes, verb, at_once, interrupt, measure, take)?;
        Ok(all)
    }
}

impl ChoiceArgs {
    /// Refuses invalid arguments.
    ///
    /// # Errors
    /// If no shape could fit them.
    pub(crate) fn check(&self) -> Result<()> {
        let most = self.max_parts.unwrap_or(usize::MAX);
        ensure!(
            self.min_parts <= most,
            UsageError("--min-parts must not be larger than --max-parts".to_owned())
        );
        ensure!(
            self.shapes != Some(0),
            UsageError("--shapes must be at least 1".to_owned())
        );
        Ok(())
    }

    /// Chooses shapes. Carriers are read if the index does not have the number of parts of a shape, or if equal shapes must be
    /// found.
    pub(crate) fn choose<'a>(&self, shapes: &'a [ShapeInput]) -> ChosenShapes<'a> {
        let mut chosen = ChosenShapes {
            shapes: Vec::new(),
            left_out: BTreeMap::new(),
        };
        let mut fitting = Vec::new();
        for shape in shapes {
            match self.reason_not_chosen(shape) {
                Some(reason) => chosen.leave_out(reason, 1),
                None => fitting.push(shape),
            }
        }
        match self.shapes {
            None => chosen.shapes = fitting,
            Some(n_most) => self.choose_distinct(fitting, n_most, &mut chosen),
        }
        chosen.shapes.sort_by(|a, b| a.id.cmp(&b.id));
        chosen
    }

    fn reason_not_chosen(&self, shape: &ShapeInput) -> Option<&'static str> {
        let read = || shape.carrier().ok().map(|carrier| carrier.n_parts());
        // A carrier that cannot be read is kept, so that it is named later. A mesh or a cloud without given labels has no parts
        // to count, and is also kept.
        let n_parts = shape
            .n_labels
            .or_else(read)
            .filter(|&n_parts| n_parts > 0)?;
        if n_parts < self.min_parts {
            Some("fewer parts than --min-parts")
        } else if self.max_parts.is_some_and(|most| most < n_parts) {
            Some("more parts than --max-parts")
        } else {
            None
        }
    }

    fn choose_distinct<'a>(
        &self,
        mut fitting: Vec<&'a ShapeInput>,
        n_most: usize,
        chosen: &mut ChosenShapes<'a>,
    ) {
        fitting.sort_by_cached_key(|shape| (seeded_rank(self.seed, &shape.id), shape.id.clone()));
        let mut distinct = DistinctShapes::default();
        for chunk in fitting.chunks(READ_AT_ONCE) {
            if chosen.shapes.len() == n_most {
                chosen.leave_out("beyond --shapes", chunk.len());
                continue;
            }
            let carriers: Vec<Option<Carrier>> =
                chunk.par_iter().map(|shape| shape.carrier().ok()).collect();
            for (shape, carrier) in chunk.iter().zip(carriers) {
                let is_twin = carrier.is_some_and(|carrier| {
                    let outline = signature_of_carrier(&carrier);
                    distinct.add(&shape.id, &outline).is_some()
                });
                if chosen.shapes.len() == n_most {
                    chosen.leave_out("beyond --shapes", 1);
                } else if is_twin {
                    chosen.leave_out(Duplicate::REASON, 1);
                } else {
                    chosen.shapes.push(shape);
                }
            }
        }
    }
}

impl ChosenShapes<'_> {
    fn leave_out(&mut self, reason: &'static str, n: usize) {
        *self.left_out.entry(reason).or_default() += n;
    }

    /// One line per reason why shapes were not chosen.
    pub(crate) fn notes(&self) -> Vec<String> {
        let note = |(reason, n): (&&str, &usize)| format!("{n} left out: {reason}");
        self.left_out.iter().map(note).collect()
    }
}
