//! HDF5, also as MATLAB 7.3: data sets of real numbers in one or two dimensions, also within groups.
//!
//! MATLAB writes a structure as a group and a matrix transposed, so that its columns lie one after the other. Attributes of a data set or of its
//! group are read where they have the names of the conventions of Climate and Forecast (netCDF) or of Keysight Infiniium: unit, first instant and
//! step, and gain and offset of integers.

use std::{collections::HashMap, path::Path};

use hdf5_pure::{AttrValue, DType, Dataset, Error, File, Group};

use super::{
    super::{ReadOptions, sampling},
    Contents, DEEPEST, MOST_UNPACKED,
    numpy::{Array, by_column, contents},
};

const HDF5: &[u8] = b"\x89HDF";
const MATLAB: &[u8] = b"MATLAB 7.3";
/// Most data sets, and most groups.
const MOST_ARRAYS: usize = 2000;

const UNIT: [&str; 3] = ["unit", "units", "YUnits"];
const STEP: [&str; 3] = ["dt", "XInc", "wf_increment"];
const RATE: [&str; 3] = ["fs", "sample_rate", "sampling_rate"];
const START: [&str; 3] = ["t0", "XOrg", "wf_start_offset"];
/// Attributes beside integers whose meaning differs between programs.
const UNUSED: [&str; 4] = ["gain", "scale", "scaling", "channelscaling"];
/// Gain and offset; whether floating-point values have them too.
const SCALES: [(&str, &str, bool); 2] = [("scale_factor", "add_offset", true), ("YInc", "YOrg", false)];

pub(super) fn is_file(head: &[u8]) -> bool {
    head.starts_with(HDF5) || head.starts_with(MATLAB)
}

pub(super) fn read(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Contents, String> {
    let is_matlab = bytes.starts_with(MATLAB);
    let form = if is_matlab { "MATLAB 7.3 (.mat)" } else { "HDF5" };
    let left = MOST_UNPACKED.saturating_mul(bytes.len());
    let mut walk =
        Walk { is_matlab, found: Vec::new(), left, visited: 0, assumptions: Vec::new(), contradiction: None };
    let file = File::from_bytes(bytes.to_vec());
    file.and_then(|file| walk.group(&file.root(), "", &HashMap::new(), 0))
        .map_err(|error| refusal(form, path, is_matlab, &error))?;
    if let Some(text) = walk.contradiction.filter(|_| options.sample_rate.is_none()) {
        return Err(format!("{form}: {text}"));
    }
    let mut contents = contents(form, walk.found, options)?;
    contents.assumptions.append(&mut walk.assumptions);
    Ok(contents)
}

struct Walk {
    is_matlab: bool,
    found: Vec<Array>,
    /// Bytes that values may still take.
    left: usize,
    visited: usize,
    assumptions: Vec<String>,
    /// Attributes that contradict each other.
    contradiction: Option<String>,
}

impl Walk {
    fn group(
        &mut self,
        group: &Group,
        prefix: &str,
        inherited: &HashMap<String, AttrValue>,
        depth: usize,
    ) -> Result<(), Error> {
        let mut attributes = inherited.clone();
        attributes.extend(group.attrs()?);
        for (name, dataset) in group.iter_datasets()? {
            if self.found.len() < MOST_ARRAYS {
                self.dataset(&dataset, format!("{prefix}{name}"), &attributes)?;
            }
        }
        for (name, inner) in group.iter_groups()? {
            self.visited += 1;
            // MATLAB keeps cells and objects under names that begin with `#`.
            if depth < DEEPEST && self.visited < MOST_ARRAYS && !(self.is_matlab && name.starts_with('#')) {
                self.group(&inner, &format!("{prefix}{name}."), &attributes, depth + 1)?;
            }
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, name: String, group: &HashMap<String, AttrValue>) -> Result<(), Error> {
        use DType::{F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        let Ok(kind @ (F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64)) = dataset.dtype() else {
            return Ok(());
        };
        let is_float = matches!(kind, F32 | F64);
        let Ok(shape) = dataset.shape() else { return Ok(()) };
        let count = shape.iter().try_fold(1, |count: usize, size| count.checked_mul(usize::try_from(*size).ok()?));
        let sizes: Vec<usize> = shape.iter().filter(|size| **size != 1).map(|size| *size as usize).collect();
        let Some(count) =
            count.filter(|count| *count > 0 && *count <= self.left / size_of::<f64>() && sizes.len() <= 2)
        else {
            return Ok(());
        };
        let attributes = dataset.attrs()?;
        let attribute = |name: &str| attributes.get(name).or_else(|| group.get(name));
        let text = |name: &str| attribute(name).and_then(AttrValue::as_str).map(|text| text.trim().to_owned());
        let number =
            |name: &str| attribute(name).and_then(|value| value.as_f64().or_else(|| Some(value.as_i64()? as f64)));
        // Texts, truth values and empty matrices of MATLAB are arrays of integers.
        let class = text("MATLAB_class").unwrap_or_default();
        if matches!(class.as_str(), "logical" | "cell") || attributes.contains_key("MATLAB_empty") {
            return Ok(());
        }
        self.left -= count * size_of::<f64>();
        let mut values = dataset.read_f64()?;
        if class == "char" {
            self.found.push(Array::of_letters(name, &values));
            return Ok(());
        }
        for (gain, offset, scales_floats) in SCALES {
            let (stated, gain, offset) =
                (number(gain).or(number(offset)), number(gain).unwrap_or(1.0), number(offset).unwrap_or(0.0));
            if stated.is_some() && is_float && !scales_floats {
                self.assumptions
                    .push(format!("`{name}`: floating-point values, taken as they are, without gain and offset"));
            } else if stated.is_some() {
                values.iter_mut().for_each(|value| *value = gain * *value + offset);
            }
        }
        let unit = UNIT.into_iter().find_map(text).unwrap_or_default();
        let start = START.into_iter().find_map(number).unwrap_or(0.0);
        let steps = STEP.into_iter().filter_map(|key| Some((key, number(key)?)));
        let rates = RATE.into_iter().filter_map(|key| Some((key, 1.0 / number(key)?)));
        let step = sampling::agreed(steps.chain(rates)).unwrap_or_else(|text| {
            self.contradiction.get_or_insert(text);
            None
        });
        let grid = step.map(|(_, step)| (start, step));
        if let Some(unused) = UNUSED.into_iter().find(|unused| !is_float && number(unused).is_some()) {
            self.assumptions.push(format!(
                "`{name}`: integers taken as they are; the attribute `{unused}` beside them is not used"
            ));
        }
        let outer = sizes.first().map_or(1, |outer| *outer);
        let inner = count / outer;
        self.found.push(match (self.is_matlab, sizes.len()) {
            (_, 0 | 1) => Array { name, unit, grid, rows: count, columns: 1, values, text: None },
            (true, _) => Array { name, unit, grid, rows: inner, columns: outer, values, text: None },
            (false, _) => {
                Array { name, unit, grid, rows: outer, columns: inner, values: by_column(&values, inner), text: None }
            }
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
