//! Prints each face of a STEP file with its type, and radius and axis if it has them.
//!
//! ```sh
//! cargo run --release -p partprobe-brep --example faces -- part.step
//! ```

use partprobe_brep::geometry::{Frame, Surface};
use partprobe_brep::{ReadBudget, read};
use std::error::Error;
use std::fs;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give the path of a STEP file")?;
    let brep = read(&fs::read(path)?, &ReadBudget::default())?;
    for face in &brep.faces {
        println!(
            "#{} {}{}",
            face.step_id,
            face.face_type.name(),
            dimensions(&face.surface)
        );
    }
    for lost in &brep.lost {
        eprintln!("lost: {lost}");
    }
    Ok(())
}

/// The numbers that describe a surface.
fn dimensions(surface: &Surface) -> String {
    match surface {
        Surface::Plane(frame) => format!(", normal {}", numbers(frame.z)),
        Surface::Cylinder { frame, radius } => format!(", radius {radius:.6}{}", axis(frame)),
        Surface::Cone {
            frame,
            radius,
            slope,
        } => {
            let half_angle = slope.atan().to_degrees();
            format!(
                ", radius {radius:.6}, half angle {half_angle:.3}°{}",
                axis(frame)
            )
        }
        Surface::Sphere { frame, radius } => {
            format!(", radius {radius:.6}, center {}", numbers(frame.origin))
        }
        Surface::Torus {
            frame,
            major,
            minor,
        } => format!(", radii {major:.6} and {minor:.6}{}", axis(frame)),
        _ => String::new(),
    }
}

fn axis(frame: &Frame) -> String {
    format!(
        ", axis {} through {}",
        numbers(frame.z),
        numbers(frame.origin)
    )
}

fn numbers([x, y, z]: [f64; 3]) -> String {
    format!("({x:.6}, {y:.6}, {z:.6})")
}
