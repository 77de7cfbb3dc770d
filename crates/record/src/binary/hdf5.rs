//! HDF5, also as MATLAB 7.3: data sets of real numbers in one or two dimensions, also within groups.
//!
//! MATLAB writes a structure as a group and a matrix transposed, so that its columns lie one after the other. A text attribute `unit` or `units`
//! of a data set is its unit.

use std::path::Path;

use hdf5_pure::{AttrValue, DType, Dataset, Error, File, Group};

use super::{
    super::ReadOptions,
    Contents,
    numpy::{Array, by_column, contents},
};

const HDF5: &[u8] = b"\x89HDF";
const MATLAB: &[u8] = b"MATLAB 7.3";
/// Most values over the file's length; most data sets; most groups within each other.
const MOST_UNPACKED: usize = 200;
const MOST_ARRAYS: usize = 2000;
const DEEPEST: usize = 6;

pub(super) fn is_file(head: &[u8]) -> bool {
    head.starts_with(HDF5) || head.starts_with(MATLAB)
}

pub(super) fn read(path: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let is_matlab = bytes.starts_with(MATLAB);
    let form = if is_matlab { "MATLAB 7.3 (.mat)" } else { "HDF5" };
    let mut walk = Walk { is_matlab, found: Vec::new(), left: MOST_UNPACKED.saturating_mul(bytes.len()), visited: 0 };
    let file = File::from_bytes(bytes.to_vec());
    file.and_then(|file| walk.group(&file.root(), "", 0)).map_err(|error| refusal(form, path, is_matlab, &error))?;
    contents(form, walk.found)
}

struct Walk {
    is_matlab: bool,
    found: Vec<Array>,
    left: usize,
    visited: usize,
}

impl Walk {
    fn group(&mut self, group: &Group, prefix: &str, depth: usize) -> Result<(), Error> {
        for (name, dataset) in group.iter_datasets()? {
            if self.found.len() < MOST_ARRAYS {
                self.dataset(&dataset, format!("{prefix}{name}"))?;
            }
        }
        for (name, inner) in group.iter_groups()? {
            self.visited += 1;
            // MATLAB keeps cells and objects under names that begin with `#`.
            if depth < DEEPEST && self.visited < MOST_ARRAYS && !(self.is_matlab && name.starts_with('#')) {
                self.group(&inner, &format!("{prefix}{name}."), depth + 1)?;
            }
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, name: String) -> Result<(), Error> {
        use DType::{F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        if !matches!(dataset.dtype(), Ok(F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64)) {
            return Ok(());
        }
        let Ok(shape) = dataset.shape() else { return Ok(()) };
        let count = shape.iter().try_fold(1, |count: usize, size| count.checked_mul(usize::try_from(*size).ok()?));
        let sizes: Vec<usize> = shape.iter().filter(|size| **size != 1).map(|size| *size as usize).collect();
        let Some(count) = count.filter(|count| *count > 0 && *count <= self.left && sizes.len() <= 2) else {
            return Ok(());
        };
        let attributes = dataset.attrs()?;
        let text = |name: &str| attributes.get(name).and_then(AttrValue::as_str).map(|text| text.trim().to_owned());
        // Texts, truth values and empty matrices of MATLAB are arrays of integers.
        let class = text("MATLAB_class").unwrap_or_default();
        if matches!(class.as_str(), "char" | "logical" | "cell") || attributes.contains_key("MATLAB_empty") {
            return Ok(());
        }
        self.left -= count;
        let values = dataset.read_f64()?;
        let unit = ["unit", "units"].into_iter().find_map(text).unwrap_or_default();
        let outer = sizes.first().map_or(1, |outer| *outer);
        let inner = count / outer;
        self.found.push(match (self.is_matlab, sizes.len()) {
            (_, 0 | 1) => Array { name, unit, rows: count, columns: 1, values },
            (true, _) => Array { name, unit, rows: inner, columns: outer, values },
            (false, _) => Array { name, unit, rows: outer, columns: inner, values: by_column(&values, inner) },
        });
        Ok(())
    }
}

fn refusal(form: &str, path: &Path, is_matlab: bool, error: &Error) -> String {
    let save = if is_matlab { "save it in MATLAB with `save(NAME, '-v7')`, or in" } else { "save its arrays with" };
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    format!(
        "{form} file: expected arrays of numbers, found: {error}; copy the file again, {save} Python:\n    import h5py, numpy\n    file = h5py.File({:?})\n    \
         numpy.savez({:?}, **{{name: it[()].squeeze() for name, it in file.items() if hasattr(it, 'shape')}})",
        name(path),
        name(&path.with_extension("npz"))
    )
}
