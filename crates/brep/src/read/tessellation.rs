//! Reads tessellated geometry: `TRIANGULATED_FACE`, `TRIANGULATED_SURFACE_SET` and their complex forms become triangles over
//! numbered corners. Two points whose coordinates are equal to the last bit are one corner.

use super::error::{EntityError, Problem};
use super::file::{StepFile, name_of};
use super::space::{Motion, Reader, Space};
use crate::part21::{Keyword, Param, ParamError, Params, Record};
use partprobe_shape::Point;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

/// The triangles of one face, as the file gives them.
pub(super) struct TessellatedFace {
    pub(super) name: Option<String>,
    /// Corners by their numbers in [`Corners`], counter-clockwise seen from outside.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The normals of the corners for which the file gives one.
    pub(super) normals: BTreeMap<u32, Point>,
    /// Whether the file numbers the corners of its triangles by the list of coordinates instead of the face's own list.
    pub(super) numbers_coordinates: bool,
}

/// The corners of one body.
#[derive(Default)]
pub(super) struct Corners {
    pub(super) points: Vec<Point>,
    number_of: HashMap<[u64; 3], u32>,
    /// The corners of each `COORDINATES_LIST` that was read.
    lists: BTreeMap<u64, Rc<Vec<u32>>>,
}

/// Whether an entity is a face or a set of triangles that [`Reader::tessellated_face`] reads.
pub(super) fn is_triangulated(source: &StepFile<'_>, record: Record) -> bool {
    match record.keyword {
        Keyword::TriangulatedFace
        | Keyword::ComplexTriangulatedFace
        | Keyword::TriangulatedSurfaceSet
        | Keyword::ComplexTriangulatedSurfaceSet => true,
        Keyword::Complex => TRIANGULATED
            .iter()
            .any(|[own, _]| source.exchange.partial(record, own).is_some()),
        _ => false,
    }
}

/// The exact face to which a tessellated face belongs, if it names one.
pub(super) fn geometric_link(source: &StepFile<'_>, record: Record) -> Option<u64> {
    let params = match record.keyword {
        Keyword::TriangulatedFace | Keyword::ComplexTriangulatedFace => {
            source.class_params(record, "", 1).ok()?
        }
        Keyword::Complex => source.exchange.partial(record, "TESSELLATED_FACE")?,
        _ => return None,
    };
    let [_, _, _, link] = params.first().ok()?;
    link.reference().ok()
}

/// The classes of triangles, and for each the class that has its coordinates.
const TRIANGULATED: [[&str; 2]; 4] = [
    ["TRIANGULATED_FACE", "TESSELLATED_FACE"],
    ["COMPLEX_TRIANGULATED_FACE", "TESSELLATED_FACE"],
    ["TRIANGULATED_SURFACE_SET", "TESSELLATED_SURFACE_SET"],
    [
        "COMPLEX_TRIANGULATED_SURFACE_SET",
        "TESSELLATED_SURFACE_SET",
    ],
];

/// The attributes of an entity of triangles.
struct Attributes<'a> {
    name: Option<String>,
    coordinates: Param<'a>,
    normals: Param<'a>,
    index: Param<'a>,
    groups: Groups<'a>,
}

/// The lists of corners from which triangles are made.
enum Groups<'a> {
    Triangles(Param<'a>),
    Strips([Param<'a>; 2]),
}

impl Groups<'_> {
    /// The triangles. Their corners are numbered from 1.
    fn triangles(self) -> Result<Vec<[usize; 3]>, EntityError> {
        match self {
            Self::Triangles(triangles) => {
                Ok(lists_of(triangles)?.into_iter().flat_map(fan).collect())
            }
            Self::Strips([strips, fans]) => {
                let strips = lists_of(strips)?.into_iter().flat_map(strip);
                let fans = lists_of(fans)?.into_iter().flat_map(fan);
                Ok(strips.chain(fans).collect())
            }
        }
    }
}

fn has_three_corners<T: PartialEq>([a, b, c]: &[T; 3]) -> bool {
    a != b && b != c && c != a
}

impl<'a> Reader<'_, 'a> {
    /// The triangles of a face.
    ///
    /// # Errors
    /// If a parameter is missing or a corner does not exist. Then no triangle of the face is read.
    pub(super) fn tessellated_face(
        &self,
        record: Record,
        corners: &mut Corners,
    ) -> Result<TessellatedFace, EntityError> {
        let attributes = attributes(self.source, record)?;
        let listed = corners.of_list(self, attributes.coordinates.reference()?)?;
        let index = counts(attributes.index)?;
        let own = if index.is_empty() {
            Rc::clone(&listed)
        } else {
            let own = index.iter().map(|&i| member(&listed, i));
            Rc::new(own.collect::<Result<_, _>>()?)
        };
        let triangles = attributes.groups.triangles()?;
        let numbers_coordinates = numbers_coordinates(&triangles, &index);
        let numbered = if numbers_coordinates { &listed } else { &own };
        let triangles = self.numbered(triangles, numbered)?;
        if triangles.is_empty() {
            return Err(Problem::Geometry("it has no triangle").into());
        }
        Ok(TessellatedFace {
            name: attributes.name,
            triangles,
            normals: self.normals(attributes.normals, &own)?,
            numbers_coordinates,
        })
    }

    /// The triangles, with the members of the list in place of their numbers. Triangles without an extent, which join strips, are
    /// left out.
    fn numbered(
        &self,
        mut triangles: Vec<[usize; 3]>,
        list: &[u32],
    ) -> Result<Vec<[u32; 3]>, EntityError> {
        triangles.retain(has_three_corners);
        let numbered = triangles.into_iter().map(|[a, b, c]| {
            let [a, b, c] = [member(list, a)?, member(list, b)?, member(list, c)?];
            Ok(if self.is_mirrored() {
                [a, c, b]
            } else {
                [a, b, c]
            })
        });
        let mut numbered = numbered.collect::<Result<Vec<_>, EntityError>>()?;
        numbered.retain(has_three_corners);
        Ok(numbered)
    }

    /// A reader in the coordinate system of a `REPOSITIONED_TESSELLATED_ITEM`. For any other entity it is this reader.
    pub(super) fn repositioned(&self, record: Record) -> Result<Self, EntityError> {
        let params = match record.keyword {
            Keyword::Complex => self
                .source
                .exchange
                .partial(record, "REPOSITIONED_TESSELLATED_ITEM"),
            _ => None,
        };
        let Some(params) = params else {
            return Ok(*self);
        };
        let [location] = params.first()?;
        let unplaced = Reader {
            space: Space {
                motion: None,
                ..self.space
            },
            ..*self
        };
        let motion = Motion::onto(&unplaced.frame(location.reference()?)?);
        let motion = self
            .space
            .motion
            .map_or(motion, |outer| outer.after(&motion));
        Ok(Reader {
            space: Space {
                motion: Some(motion),
                ..self.space
            },
            ..*self
        })
    }

    /// The normals of the local corners: one for all corners, one per corner, or none.
    fn normals(
        &self,
        normals: Param<'a>,
        local: &[u32],
    ) -> Result<BTreeMap<u32, Point>, EntityError> {
        let Param::List(list) = normals else {
            return Ok(BTreeMap::new());
        };
        let mut read = Vec::new();
        for normal in list.iter() {
            let [x, y, z] = normal?.list()?.first()?;
            let normal = [x.number()?, y.number()?, z.number()?];
            read.push(
                self.space
                    .motion
                    .map_or(normal, |motion| motion.direction(normal)),
            );
        }
        Ok(match read.as_slice() {
            [one] => local.iter().map(|&corner| (corner, *one)).collect(),
            _ => local.iter().copied().zip(read).collect(),
        })
    }
}

impl Corners {
    /// The corners of a `COORDINATES_LIST`, read once for all faces that share it.
    fn of_list(&mut self, reader: &Reader<'_, '_>, id: u64) -> Result<Rc<Vec<u32>>, EntityError> {
        if let Some(known) = self.lists.get(&id) {
            return Ok(Rc::clone(known));
        }
        let listed = reader.source.entity(id, |record| {
            let params = match record.keyword {
                Keyword::CoordinatesList => reader.source.class_params(record, "", 1)?,
                Keyword::Complex => {
                    let partial = reader.source.exchange.partial(record, "COORDINATES_LIST");
                    partial
                        .ok_or_else(|| reader.source.wrong_class(record, "list of coordinates"))?
                }
                _ => return Err(reader.source.wrong_class(record, "list of coordinates")),
            };
            let [_, coordinates] = params.first()?;
            let points = coordinates
                .list()?
                .iter()
                .map(|point| reader.placed(point?));
            points
                .map(|point| Ok(self.number(point?)))
                .collect::<Result<Vec<u32>, EntityError>>()
        })?;
        let listed = Rc::new(listed);
        self.lists.insert(id, Rc::clone(&listed));
        Ok(listed)
    }

    fn number(&mut self, point: Point) -> u32 {
        // The coordinates -0 and 0 are equal.
        let key = point.map(|x| (x + 0.0).to_bits());
        *self.number_of.entry(key).or_insert_with(|| {
            self.points.push(point);
            self.points.len() as u32 - 1
        })
    }

    /// Forgets the lists, because the next entities have another position.
    pub(super) fn forget_lists(&mut self) {
        self.lists.clear();
    }
}

fn attributes<'a>(source: &StepFile<'a>, record: Record) -> Result<Attributes<'a>, EntityError> {
    match record.keyword {
        Keyword::TriangulatedFace => {
            let [name, coordinates, _, normals, _, index, triangles] = source.params(record)?;
            let groups = Groups::Triangles(triangles);
            Ok(Attributes {
                name: name_of(name),
                coordinates,
                normals,
                index,
                groups,
            })
        }
        Keyword::ComplexTriangulatedFace => {
            let [name, coordinates, _, normals, _, index, strips, fans] = source.params(record)?;
            let groups = Groups::Strips([strips, fans]);
            Ok(Attributes {
                name: name_of(name),
                coordinates,
                normals,
                index,
                groups,
            })
        }
        Keyword::TriangulatedSurfaceSet => {
            let [name, coordinates, _, normals, index, triangles] = source.params(record)?;
            let groups = Groups::Triangles(triangles);
            Ok(Attributes {
                name: name_of(name),
                coordinates,
                normals,
                index,
                groups,
            })
        }
        Keyword::ComplexTriangulatedSurfaceSet => {
            let [name, coordinates, _, normals, index, strips, fans] = source.params(record)?;
            let groups = Groups::Strips([strips, fans]);
            Ok(Attributes {
                name: name_of(name),
                coordinates,
                normals,
                index,
                groups,
            })
        }
        _ => complex_attributes(source, record),
    }
}

fn complex_attributes<'a>(
    source: &StepFile<'a>,
    record: Record,
) -> Result<Attributes<'a>, EntityError> {
    let partial = |name| source.exchange.partial(record, name);
    let own = TRIANGULATED
        .iter()
        .find_map(|&[own, base]| Some((own, partial(own)?, partial(base)?)));
    let (class, own, base) = own.ok_or_else(|| source.wrong_class(record, "tessellated face"))?;
    let [coordinates, _, normals] = base.first()?;
    let name = partial("REPRESENTATION_ITEM")
        .and_then(|item| item.first::<1>().ok())
        .and_then(|[name]| name_of(name));
    let [index, first] = own.first()?;
    let groups = if class.starts_with("COMPLEX") {
        let [_, strips, fans] = own.first()?;
        Groups::Strips([strips, fans])
    } else {
        Groups::Triangles(first)
    };
    Ok(Attributes {
        name,
        coordinates,
        normals,
        index,
        groups,
    })
}

/// Lists of counts. The result is empty if the parameter is left out.
fn lists_of(param: Param<'_>) -> Result<Vec<Vec<usize>>, EntityError> {
    match param {
        Param::Unset | Param::Derived => Ok(Vec::new()),
        lists => lists.list()?.iter().map(|list| counts(list?)).collect(),
    }
}

fn counts(param: Param<'_>) -> Result<Vec<usize>, EntityError> {
    let list = match param {
        Param::Unset | Param::Derived => return Ok(Vec::new()),
        list => list.list()?,
    };
    let counts = |list: Params<'_>| {
        list.iter()
            .map(|number| number?.count())
            .collect::<Result<_, ParamError>>()
    };
    Ok(counts(list)?)
}

/// The member with this number, counted from 1.
fn member(list: &[u32], number: usize) -> Result<u32, EntityError> {
    let found = number.checked_sub(1).and_then(|index| list.get(index));
    found.copied().ok_or_else(|| {
        Problem::NoMember {
            number,
            n_members: list.len(),
        }
        .into()
    })
}

/// Whether the corners of triangles are numbers of coordinates instead of members of the face's own list, because that list lacks
/// some of them. Some writers number them in this way.
fn numbers_coordinates(triangles: &[[usize; 3]], index: &[usize]) -> bool {
    let named = || triangles.iter().flatten();
    if index.is_empty() || named().all(|&corner| corner <= index.len()) {
        return false;
    }
    let known: BTreeSet<usize> = index.iter().copied().collect();
    named().all(|corner| known.contains(corner))
}

/// Triangles around the first corner.
fn fan(corners: Vec<usize>) -> Vec<[usize; 3]> {
    corners
        .windows(2)
        .skip(1)
        .map(|pair| [corners[0], pair[0], pair[1]])
        .collect()
}

/// Triangles of three corners in a row, every other one reversed.
fn strip(corners: Vec<usize>) -> Vec<[usize; 3]> {
    let oriented = |(i, row): (usize, &[usize])| {
        if i % 2 == 0 {
            [row[0], row[1], row[2]]
        } else {
            [row[0], row[2], row[1]]
        }
    };
    corners.windows(3).enumerate().map(oriented).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_are_triangles_of_one_sense() {
        assert_eq!(
            strip(vec![1, 2, 3, 4, 5]),
            [[1, 2, 3], [2, 4, 3], [3, 4, 5]]
        );
        assert_eq!(fan(vec![1, 2, 3, 4]), [[1, 2, 3], [1, 3, 4]]);
        assert_eq!((strip(vec![1, 2]), fan(vec![7])), (vec![], vec![]));
    }
}
