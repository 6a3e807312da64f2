//! Measures many shapes on the threads of the current pool, and returns the results in the order of the shapes.
//!
//! Only a limited number of shapes is in memory at once, so that the work can be stopped between them.

use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::shape_input::ShapeInput;
use anyhow::{Result, bail};
use rayon::prelude::*;

/// Measures `at_once` shapes before the next ones are started. `take` gets the results in the order of the shapes, for any speed
/// of the threads. A bar on stderr is named `verb`.
///
/// # Errors
/// If the user stops the program.
pub(crate) fn for_each_measured<T: Send>(
    shapes: &[&ShapeInput],
    verb: &str,
    at_once: usize,
    interrupt: &Interrupt,
    measure: impl Fn(&ShapeInput) -> T + Sync,
    mut take: impl FnMut(T),
) -> Result<()> {
    let bar = Progress::on_terminal().bar(verb, shapes.len());
    for chunk in shapes.chunks(at_once) {
        let measured = chunk.par_iter().map(|shape| {
            let found = (!interrupt.is_set()).then(|| measure(shape));
            bar.inc(1);
            found
        });
        let measured: Vec<Option<T>> = measured.collect();
        if interrupt.is_set() {
            bail!("stopped; nothing was written");
        }
        measured.into_iter().flatten().for_each(&mut take);
    }
    bar.finish_and_clear();
    Ok(())
}
