//! Fields as files: VTK unstructured grids (`.vtu`) and the collection of a series (`.pvd`), for ParaView or meshio.
//!
//! Axes: x = r, y = z (along the chain), third coordinate 0. Points stand where they are at rest; *Warp By Vector* with `displacement`
//! moves them. Arrays are binary, base64 in place: a little-endian UInt64 count of bytes, then the values. The same field gives the same
//! bytes.
//!
//! Kitware, *VTK File Formats*, section XML File Formats.

use std::io::{self, Write};

use base64::{Engine, engine::general_purpose::STANDARD};
use quick_xml::{
    Writer,
    events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event},
};
use thiserror::Error;

use super::field::{Field, FieldError};

/// Kind of every cell, as VTK numbers it.
const QUADRATIC_QUADRILATERAL: u8 = 23;

#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VtuError {
    #[error(transparent)]
    Field(#[from] FieldError),
    #[error("the field of t = {time:.9e} s could not be written")]
    Io { time: f64, source: io::Error },
}

/// Write a field as one `.vtu`: point data `displacement` (m), `velocity` (m/s), `stress` (Pa; rr, zz, θθ, rz) and `von_mises` (Pa) as far
/// as it carries them, cell data `body` (from 1, in the order of the field), field data `TimeValue` (s).
pub fn write_vtu(field: &Field, writer: impl Write) -> Result<(), VtuError> {
    field.check()?;
    write(field, writer).map_err(|source| VtuError::Io { time: field.time, source })
}

/// Write the `.pvd` of a series: simulated time (s) and file, relative to the `.pvd`, of every frame.
pub fn write_pvd<'a>(frames: impl IntoIterator<Item = (f64, &'a str)>, writer: impl Write) -> io::Result<()> {
    let mut file = Document::begin(writer, "Collection")?;
    file.open("Collection", &[])?;
    for (time, name) in frames {
        let time = ryu::Buffer::new().format(time).to_owned();
        file.empty("DataSet", &[("timestep", &time), ("group", ""), ("part", "0"), ("file", name)])?;
    }
    file.close("Collection")?;
    file.end()
}

fn write(field: &Field, writer: impl Write) -> io::Result<()> {
    let mut file = Document::begin(writer, "UnstructuredGrid")?;
    let meshes = || field.bodies.iter().map(|body| &*body.mesh);
    let points: usize = meshes().map(|mesh| mesh.points.len()).sum();
    let cells: usize = meshes().map(|mesh| mesh.cells.len()).sum();

    file.open("UnstructuredGrid", &[])?;
    file.open("FieldData", &[])?;
    file.array("TimeValue", &[("NumberOfTuples", "1")], &[field.time])?;
    file.close("FieldData")?;
    file.open("Piece", &[("NumberOfPoints", &points.to_string()), ("NumberOfCells", &cells.to_string())])?;

    let [displacement, velocity, stress, von_mises] = field.carries();
    file.open("PointData", &[])?;
    let vector = &[("NumberOfComponents", "3")];
    let flat = |[r, z]: &[f64; 2]| [*r, *z, 0.0];
    if displacement {
        let values: Vec<f64> = field.bodies.iter().flat_map(|body| body.displacement.iter().flat_map(flat)).collect();
        file.array("displacement", vector, &values)?;
    }
    if velocity {
        let values: Vec<f64> = field.bodies.iter().flat_map(|body| body.velocity.iter().flat_map(flat)).collect();
        file.array("velocity", vector, &values)?;
    }
    if stress {
        let values: Vec<f64> = field.bodies.iter().flat_map(|body| body.stress.iter().flatten().copied()).collect();
        let names = [
            ("NumberOfComponents", "4"),
            ("ComponentName0", "rr"),
            ("ComponentName1", "zz"),
            ("ComponentName2", "tt"),
            ("ComponentName3", "rz"),
        ];
        file.array("stress", &names, &values)?;
    }
    if von_mises {
        let values: Vec<f64> = field.bodies.iter().flat_map(|body| body.von_mises.iter().copied()).collect();
        file.array("von_mises", &[], &values)?;
    }
    file.close("PointData")?;

    file.open("CellData", &[])?;
    let numbered = || (1_i32..).zip(meshes());
    let bodies: Vec<i32> = numbered().flat_map(|(number, mesh)| mesh.cells.iter().map(move |_| number)).collect();
    file.array("body", &[], &bodies)?;
    file.close("CellData")?;

    file.open("Points", &[])?;
    let places = field.bodies.iter().flat_map(|body| body.mesh.points.iter().map(|[r, z]| [*r, z + body.offset, 0.0]));
    file.array("Points", vector, &places.flatten().collect::<Vec<f64>>())?;
    file.close("Points")?;

    file.open("Cells", &[])?;
    let mut connectivity = Vec::with_capacity(8 * cells);
    let mut first_point = 0_i64;
    for mesh in meshes() {
        connectivity.extend(mesh.cells.iter().flatten().map(|point| first_point + i64::from(*point)));
        first_point += mesh.points.len() as i64;
    }
    let offsets: Vec<i64> = (1..=cells as i64).map(|cell| 8 * cell).collect();
    file.array("connectivity", &[], &connectivity)?;
    file.array("offsets", &[], &offsets)?;
    file.array("types", &[], &vec![QUADRATIC_QUADRILATERAL; cells])?;
    file.close("Cells")?;

    file.close("Piece")?;
    file.close("UnstructuredGrid")?;
    file.end()
}

/// A number as VTK names and stores it.
trait Number: Copy {
    const NAME: &'static str;
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($kind:ty = $name:literal),*) => {
        $(impl Number for $kind {
            const NAME: &'static str = $name;
            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        })*
    };
}

numbers!(f64 = "Float64", i64 = "Int64", i32 = "Int32", u8 = "UInt8");

/// A `<VTKFile>` in the making.
struct Document<W: Write> {
    xml: Writer<W>,
}

impl<W: Write> Document<W> {
    fn begin(writer: W, kind: &str) -> io::Result<Self> {
        let mut document = Self { xml: Writer::new_with_indent(writer, b' ', 1) };
        document.xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        let (order, header) = (("byte_order", "LittleEndian"), ("header_type", "UInt64"));
        document.open("VTKFile", &[("type", kind), ("version", "1.0"), order, header])?;
        Ok(document)
    }

    fn open(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        self.xml.write_event(Event::Start(BytesStart::new(name).with_attributes(attributes.iter().copied())))
    }

    fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        self.xml.write_event(Event::Empty(BytesStart::new(name).with_attributes(attributes.iter().copied())))
    }

    fn close(&mut self, name: &str) -> io::Result<()> {
        self.xml.write_event(Event::End(BytesEnd::new(name)))
    }

    /// One array: header and values in one base64 stream.
    fn array<N: Number>(&mut self, name: &str, more: &[(&str, &str)], values: &[N]) -> io::Result<()> {
        let mut attributes = vec![("type", N::NAME), ("Name", name)];
        attributes.extend_from_slice(more);
        attributes.push(("format", "binary"));
        let length = size_of_val(values);
        let mut bytes = Vec::with_capacity(8 + length);
        bytes.extend_from_slice(&(length as u64).to_le_bytes());
        values.iter().for_each(|value| value.append(&mut bytes));
        self.open("DataArray", &attributes)?;
        self.xml.write_event(Event::Text(BytesText::new(&STANDARD.encode(bytes))))?;
        self.close("DataArray")
    }

    fn end(mut self) -> io::Result<()> {
        self.close("VTKFile")?;
        let mut writer = self.xml.into_inner();
        writer.write_all(b"\n")?;
        writer.flush()
    }
}
