//! Reads and writes files: bytes become exchange types, and back.
//!
//! | folder | files |
//! |---|---|
//! | `numpy` | NPY arrays, NPZ archives of named arrays, and the hash of their content |
//! | `carrier` | carriers as NPZ archives, tables of their faces and edges |
//! | `mesh` | OBJ, PLY, GLB, and foreign glTF, OFF and STL files |
//! | `archive` | zip, tar and 7z archives of STEP files, packed STEP files, names of their members |
//! | `pointcept` | the folders that Pointcept trains on |
//! | `partfield` | the meshes that PartField reads, and the map back to their carriers |
//! | `webdataset` | the tar files that WebDataset reads |
//!
//! Bytes go in and values come out, or the reverse.
//!
//! ```
//! use partprobe_formats::{Compression, arrays_from_npz, carrier_from_npz, carrier_to_npz};
//!
//! let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
//! let file = partprobe_label::label(text.as_bytes(), "block", &Default::default())?;
//! let bytes = carrier_to_npz(file.shapes[0].carrier.as_ref().unwrap(), Compression::Stored)?;
//!
//! // The bytes of a carrier file become a carrier again, or plain arrays by name.
//! let carrier = carrier_from_npz(&bytes)?;
//! assert_eq!(carrier.meta().id, "block");
//! assert_eq!(carrier.n_raw_parts(), 6);
//! let arrays = arrays_from_npz(&bytes)?;
//! assert_eq!(arrays.array("face_label").unwrap().shape(), [6]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - The bytes depend only on the value: archives contain a fixed date, and members keep their order.
//! - A reader compares the sizes in a header with the bytes that are present, so a hostile header cannot make it allocate more
//!   than a small multiple of its input.
//! - A file that is cut off or changed gives an error, never a panic.
//!
//! # What it does not do
//!
//! It opens no file and prints nothing. Formats with more data than partprobe needs are read in part. Of PLY, for example, it
//! reads positions, normals, triangles and parts.

mod archive;
mod carrier;
#[cfg(test)]
mod fixtures;
mod format_version;
mod mesh;
mod numpy;
mod partfield;
mod point_sample;
mod pointcept;
mod tensorboard;
mod webdataset;

pub use archive::name_text::{name_of_text, text_of_name};
pub use archive::step_name::{is_step_xml_name, step_stem};
pub use archive::{
    ArchiveDamage, ArchiveKind, Content, ContentError, Member, MemberName, Packing, Refusal,
    UnpackError, Visit, ZstdReader, listed_names, unpacked_step, walk_archive,
};
pub use carrier::face_tables::{edges_to_csv, faces_to_csv};
pub use carrier::npz::{
    CarrierFile, CarrierFileError, carrier_array, carrier_file, carrier_from_npz, carrier_to_npz,
    hashed_carrier_from_npz, labels_to_npz,
};
pub use format_version::FORMAT_VERSION;
pub use mesh::foreign::MeshFileError;
pub use mesh::glb::{GlbError, GlbNodes, carrier_to_glb};
pub use mesh::gltf::error::GltfError;
pub use mesh::gltf::read::marked_mesh_from_gltf;
pub use mesh::labeled_mesh::LabeledMesh;
pub use mesh::marked_mesh::{Mark, MarkValues, Marked, MarkedMesh, MarkedPoints};
pub use mesh::obj::read::{marked_mesh_from_obj, mesh_from_obj};
pub use mesh::obj::write::{integer_lines, mesh_to_obj};
pub use mesh::off::mesh_from_off;
pub use mesh::ply::marked::{marked_mesh_from_ply, marked_points_from_ply};
pub use mesh::ply::points::{
    PlyError, PlyPoints, colored_points_to_ply, points_from_ply, points_to_ply,
};
pub use mesh::ply::read::{PlyScene, scene_from_ply};
pub use mesh::ply::write::mesh_to_ply;
pub use mesh::stl::mesh_from_stl;
pub use numpy::array::{Array, Element, Values};
pub use numpy::content_hash::{ContentHash, mesh_hash};
pub use numpy::half::Half;
pub use numpy::members::{MemberError, Members};
pub use numpy::npy::{array_from_npy, array_to_npy};
pub use numpy::npy_header::NpyError;
pub use numpy::npz::{Compression, NpzError, NpzWriteError, arrays_from_npz, arrays_to_npz};
pub use partfield::map::{PARTFIELD_MAP_FILE, PartFieldMap, PartFieldMapError, PartFieldShape};
pub use partfield::mesh::{PartFieldLimits, PartFieldMesh, PartFieldRefusal};
pub use partfield::names::partfield_names;
pub use point_sample::{
    SampleFileError, SampleLabels, sample_from_npz, sample_to_npz, sample_with_attributes_to_npz,
};
pub use pointcept::check::{PointceptProblem, check_pointcept_shape};
pub use pointcept::folder::{
    POINTCEPT_EXPERIMENTS, POINTCEPT_FILES, pointcept_config, pointcept_experiments,
    pointcept_files,
};
pub use tensorboard::{TensorboardEvent, tensorboard_record};
pub use webdataset::{WebdatasetWriter, webdataset_keys};
