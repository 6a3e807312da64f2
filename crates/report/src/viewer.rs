//! Writes the frame of the 3D view: four panes with linked cameras, the list of parts, and a line about the point under the
//! pointer.

use crate::html::{escaped, section};
use crate::shape_digest::ShapeDigest;
use std::fmt::Write as _;

/// The number of panes. The script chooses the initial content of each pane.
const N_PANES: usize = 4;

/// The section of the view. It is empty without shapes.
pub(crate) fn viewer(shapes: &[ShapeDigest]) -> String {
    let mut options = String::new();
    for (idx, shape) in shapes
        .iter()
        .enumerate()
        .filter(|(_, shape)| !shape.references.is_empty())
    {
        let _ = write!(
            options,
            "<option value=\"{idx}\">{}</option>",
            escaped(&shape.id)
        );
    }
    if options.is_empty() {
        return options;
    }
    let mut panes = String::new();
    for pane in 0..N_PANES {
        let _ = write!(
            panes,
            "<div class=\"pane\"><select aria-label=\"What pane {} shows\"></select></div>",
            pane + 1
        );
    }
    let body = format!(
        "<p class=\"filter\"><button type=\"button\" id=\"previous-shape\" aria-label=\"Previous shape\">‹</button>\
         <label class=\"wide\">Shape <select id=\"shape\">{options}</select></label>\
         <button type=\"button\" id=\"next-shape\" aria-label=\"Next shape\">›</button>\
         <button type=\"button\" id=\"reset-view\">Reset view</button></p>\n\
         <div id=\"panes\"><canvas id=\"view-canvas\" tabindex=\"0\" aria-label=\"3D view. Arrow keys turn, plus and minus zoom, Enter picks the middle, Escape clears.\"></canvas>{panes}</div>\n\
         <p id=\"picked\" role=\"status\">Point at the surface to read its part and face.</p>\n\
         <div id=\"parts\" role=\"group\" aria-label=\"Parts of the reference\"></div>\n"
    );
    section(
        "view",
        "3D view",
        "Drag to turn, with Shift to move; the wheel zooms once the view was clicked, and two fingers do both. Click a part to keep it, \
         Escape to let it go. All panes have one camera.",
        &body,
    )
}
