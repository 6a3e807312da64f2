//! Lists the reasons why a file or one of its shapes has no carrier.

use partprobe_brep::ReadError;
use partprobe_carrier::{CarrierError, GivenError};
use partprobe_sources::SourceError;
use partprobe_truck::TruckError;

/// The reason why a file or one of its shapes has no carrier.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LabelError {
    /// The text cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The mesh is larger than the options allow.
    #[error(
        "the mesh has more than {limit} triangles; raise label.max_triangles or the tolerances"
    )]
    TooManyTriangles {
        /// The largest number of triangles that the options allow.
        limit: u64,
    },
    /// Every face was lost.
    #[error("no face could be triangulated; {n_lost} were lost")]
    NoTriangle {
        /// How many faces, loops and entities were lost.
        n_lost: usize,
    },
    /// Each solid should become a shape, but the file has no solid.
    #[error("no face of the file belongs to a solid; label with label.unit = \"file\"")]
    NoSolid,
    /// A requested layer has no source, or its source does not label whole faces.
    #[error(transparent)]
    Layer(#[from] SourceError),
    /// The options need a function that the second kernel does not have.
    #[error("truck labels whole files without instances; use the own kernel, or Unit::File")]
    WholeFilesOnly,
    /// The result of the kernel is not consistent.
    #[error(transparent)]
    Carrier(#[from] CarrierError),
    /// A mesh or a point cloud has no carrier.
    #[error(transparent)]
    Given(#[from] GivenError),
    /// The second kernel cannot read the text.
    #[error(transparent)]
    Truck(#[from] TruckError),
}

impl LabelError {
    /// Whether the file needs more than the options allow, so that it could be read with other options.
    #[must_use]
    pub fn is_over_budget(&self) -> bool {
        matches!(
            self,
            Self::TooManyTriangles { .. } | Self::Read(ReadError::OverBudget { .. })
        )
    }
}
