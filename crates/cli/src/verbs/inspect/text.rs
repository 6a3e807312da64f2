//! Writes the report for a reader: a summary, the parts, and the lost entities.

use super::report::{FaceReport, InspectReport, SolidReport};
use super::surface::SurfaceReport;
use crate::counted::counted;
use crate::markdown_table::Alignment::{Left, Right};
use crate::markdown_table::markdown_table;
use std::collections::BTreeMap;
use std::fmt;

/// The largest number of rows of a list. Longer lists end with the number of rows that are left out.
const MAX_ROWS: usize = 60;
/// The number of faces that are named per part.
const MAX_STEP_IDS: usize = 8;

impl fmt::Display for InspectReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n_undefined = self.edges.iter().filter(|edge| edge.phi.is_none()).count();
        writeln!(
            f,
            "{} in {}, {} ({n_undefined} without an angle)",
            counted(self.faces.len(), "face", "faces"),
            counted(self.n_parts as usize, "part", "parts"),
            counted(self.edges.len(), "shared edge", "shared edges")
        )?;
        let (units, mesh) = (&self.units, &self.mesh);
        writeln!(
            f,
            "units: {} ({} mm), {}; below everything is in mm and degrees",
            units.length, units.mm_per_unit, units.angle
        )?;
        writeln!(
            f,
            "mesh: {}",
            counted(mesh.triangles, "triangle", "triangles")
        )?;
        if let Some([low, high]) = mesh.bounding_box {
            writeln!(f, "bounding box: {} to {}", numbers(low), numbers(high))?;
        }
        self.write_solids(f)?;
        self.write_parts(f)?;
        self.write_dimensions(f)?;
        writeln!(
            f,
            "\nlost: {}",
            if self.lost.is_empty() {
                "nothing".to_owned()
            } else {
                self.lost.len().to_string()
            }
        )?;
        for loss in self.lost.iter().take(MAX_ROWS) {
            match loss.step_id {
                0 => writeln!(f, "  {}", loss.reason)?,
                id => writeln!(f, "  {} #{id}: {}", loss.kind, loss.reason)?,
            }
        }
        write_rest(f, self.lost.len())?;
        for note in self.notes.iter().take(MAX_ROWS) {
            match note.step_id {
                0 => writeln!(f, "note: {}", note.text)?,
                id => writeln!(f, "note: #{id}: {}", note.text)?,
            }
        }
        write_rest(f, self.notes.len())?;
        write!(
            f,
            "read in {:.1} ms, measured in {:.1} ms",
            1e3 * self.timings.read_s,
            1e3 * self.timings.shape_s
        )
    }
}

impl InspectReport {
    fn write_solids(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let solids = &self.mesh.solids;
        if solids.is_empty() {
            return Ok(());
        }
        let rows = solids.iter().take(MAX_ROWS).map(|solid| {
            [
                format!("#{}", solid.step_id),
                solid.name.as_deref().unwrap_or("unnamed").to_owned(),
                format!("{:.6}", solid.volume),
                format!("{:.6}", solid.mesh_volume),
                format!("{:.6}", solid.area),
                solid.centroid.map_or_else(|| "–".to_owned(), numbers),
                closing(solid).to_owned(),
            ]
        });
        let heading = [
            "solid",
            "name",
            "volume",
            "volume of the mesh",
            "area",
            "center of mass",
            "mesh",
        ];
        let alignment = [Left, Left, Right, Right, Right, Left, Left];
        write_table(f, &markdown_table(heading, alignment, rows), solids.len())
    }

    /// Writes radius, angle and axis of the curved faces. Planes are left out because there are many, and `--json` has them.
    fn write_dimensions(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let curved: Vec<(&FaceReport, &SurfaceReport)> = self
            .faces
            .iter()
            .filter_map(|face| Some((face, face.surface.as_ref()?)))
            .filter(|(_, surface)| surface.radius.is_some())
            .collect();
        if curved.is_empty() {
            return Ok(());
        }
        let rows = curved.iter().take(MAX_ROWS).map(|(face, surface)| {
            [
                format!("#{}", face.step_id),
                face.face_type.to_owned(),
                dimensions(surface),
            ]
        });
        let table = markdown_table(["curved face", "type", "dimensions"], [Left; 3], rows);
        write_table(f, &table, curved.len())
    }

    fn write_parts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: BTreeMap<u32, Vec<&FaceReport>> = BTreeMap::new();
        for face in &self.faces {
            parts.entry(face.part).or_default().push(face);
        }
        let rows = parts.iter().take(MAX_ROWS).map(|(part, faces)| {
            let area: f64 = faces.iter().map(|face| face.area).sum();
            let named = faces.iter().take(MAX_STEP_IDS);
            let mut ids: Vec<String> = named.map(|face| format!("#{}", face.step_id)).collect();
            if faces.len() > MAX_STEP_IDS {
                ids.push("…".to_owned());
            }
            [
                part.to_string(),
                faces[0].face_type.to_owned(),
                faces.len().to_string(),
                format!("{area:.4}"),
                ids.join(" "),
            ]
        });
        let heading = ["part", "type", "faces", "area", "step ids"];
        let alignment = [Right, Left, Right, Right, Left];
        write_table(f, &markdown_table(heading, alignment, rows), parts.len())
    }
}

/// Writes a table after an empty line, and the number of rows that are left out.
fn write_table(f: &mut fmt::Formatter<'_>, table: &str, n_rows: usize) -> fmt::Result {
    writeln!(f, "\n{table}")?;
    if n_rows > MAX_ROWS {
        // Without an empty line, the count would be a row of the table.
        writeln!(f)?;
    }
    write_rest(f, n_rows)
}

/// The dimensions of a face in words.
fn dimensions(surface: &SurfaceReport) -> String {
    let mut words = Vec::new();
    if let Some(radius) = surface.radius {
        words.push(format!("radius {radius:.6}"));
    }
    if let Some(radius) = surface.minor_radius {
        words.push(format!("tube radius {radius:.6}"));
    }
    if let Some(angle) = surface.half_angle {
        words.push(format!("half angle {angle:.3}"));
    }
    words.push(format!(
        "axis {} through {}",
        numbers(surface.axis),
        numbers(surface.origin)
    ));
    words.join(", ")
}

fn numbers([x, y, z]: [f64; 3]) -> String {
    format!("({x:.3}, {y:.3}, {z:.3})")
}

/// A text that says whether a solid's mesh is closed.
fn closing(solid: &SolidReport) -> &'static str {
    match (solid.watertight, solid.manifold, solid.closed) {
        (true, _, _) if solid.mesh_volume <= 0.0 => "watertight, but turned inside out",
        (true, true, _) => "watertight",
        (true, false, _) => "watertight; it touches itself along edges",
        (false, _, true) => "not watertight, although the file closes it",
        (false, _, false) => "open in the file",
    }
}

fn write_rest(f: &mut fmt::Formatter<'_>, n_rows: usize) -> fmt::Result {
    if n_rows > MAX_ROWS {
        writeln!(f, "  … and {} more", n_rows - MAX_ROWS)
    } else {
        Ok(())
    }
}
