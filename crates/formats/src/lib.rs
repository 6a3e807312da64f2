//! File formats: bytes to exchange types and back.
//!
//! What goes in is a slice of bytes or a value, what comes out is the other; no file is opened and nothing is printed.
//! Bytes depend only on the value: archives carry a fixed date, members keep their order.
//! Nothing that a file claims is believed before it is compared with the bytes that are there,
//! so a hostile header cannot make a reader allocate more than a small multiple of its input.

mod archive;
mod array;
mod carrier_meta;
mod carrier_npz;
mod content_hash;
mod face_tables;
#[cfg(test)]
mod fixtures;
mod glb;
mod half;
mod labeled_mesh;
mod members;
mod mesh_file;
mod mesh_ply;
mod name_text;
mod npy;
mod npy_header;
mod npz;
mod obj;
mod ply;
mod point_sample_npz;
mod pointcept;
mod pointcept_check;
mod smooth_normals;
mod step_name;
mod tensorboard;

pub use archive::{
    ArchiveDamage, ArchiveKind, Content, ContentError, Member, MemberName, Packing, Refusal,
    UnpackError, Visit, listed_names, unpacked_step, walk_archive,
};
pub use array::{Array, Element, Values};
pub use carrier_npz::{
    CarrierFile, CarrierFileError, carrier_file, carrier_from_npz, carrier_to_npz,
    hashed_carrier_from_npz, labels_to_npz,
};
pub use content_hash::{ContentHash, mesh_hash};
pub use face_tables::{edges_to_csv, faces_to_csv};
pub use glb::{GlbError, carrier_to_glb};
pub use half::Half;
pub use labeled_mesh::LabeledMesh;
pub use members::{MemberError, Members};
pub use mesh_file::{
    MeshFileError, PlyScene, mesh_from_obj, mesh_from_off, mesh_from_stl, scene_from_ply,
};
pub use mesh_ply::mesh_to_ply;
pub use name_text::{name_of_text, text_of_name};
pub use npy::{NpyError, array_from_npy, array_to_npy};
pub use npz::{Compression, NpzError, NpzWriteError, arrays_from_npz, arrays_to_npz};
pub use obj::{integer_lines, mesh_to_obj};
pub use ply::{PlyError, PlyPoints, points_from_ply, points_to_ply};

pub use point_sample_npz::{
    SampleFileError, SampleLabels, sample_from_npz, sample_to_npz, sample_with_attributes_to_npz,
};
pub use pointcept::{POINTCEPT_FILES, pointcept_config, pointcept_files};
pub use pointcept_check::{PointceptProblem, check_pointcept_shape};
pub use smooth_normals::smooth_normals;
pub use step_name::{is_step_xml_name, step_stem};
pub use tensorboard::{TensorboardEvent, tensorboard_record};

/// The version that every archive and every JSON file of partprobe carries; a reader refuses a higher one.
pub const FORMAT_VERSION: u32 = 1;
