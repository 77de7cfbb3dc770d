//! HDF5, which MATLAB writes as version 7.3: named, with what to type.

use std::path::Path;

use super::{super::ReadOptions, Contents};

const HDF5: &[u8] = b"\x89HDF";
const MATLAB: &[u8] = b"MATLAB 7.3";

pub(super) fn is_file(head: &[u8]) -> bool {
    head.starts_with(HDF5) || head.starts_with(MATLAB)
}

pub(super) fn refuse(path: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let (form, matlab) = if bytes.starts_with(MATLAB) {
        ("MATLAB 7.3 (HDF5)", "save it in MATLAB with `save(NAME, '-v7')`, or in")
    } else {
        ("HDF5", "save the arrays of the record with")
    };
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let quoted = |name: &str| format!("{name:?}");
    let saved =
        path.with_extension("npz").file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Err(format!(
        "{form} file: expected one of the forms that are read, found HDF5; {matlab} Python:\n    import h5py, numpy\n    file = h5py.File({})\n    \
         numpy.savez({}, **{{name: it[()].squeeze() for name, it in file.items() if hasattr(it, 'shape')}})",
        quoted(&name),
        quoted(&saved)
    ))
}
