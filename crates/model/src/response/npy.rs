//! Arrays as NumPy's own files.

use std::io::{self, Write};

/// Write a matrix of `f64` as NPY 1.0, little endian, C order: what `numpy.load` gives as an array of shape (rows, columns).
///
/// NumPy Enhancement Proposal 1, *A Simple File Format for NumPy Arrays*.
pub fn write_npy(rows: &[Vec<f64>], mut writer: impl Write) -> io::Result<()> {
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(row) = rows.iter().position(|row| row.len() != columns) {
        let found = rows[row].len();
        let message = format!("row {row} of an array: expected {columns} numbers as in the first, found {found}");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {columns}), }}", rows.len());
    // Magic string, version and length take ten bytes; the data begin at a multiple of 64.
    let padding = 63 - (10 + header.len()) % 64;
    header.push_str(&" ".repeat(padding));
    header.push('\n');
    let length = u16::try_from(header.len()).map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    writer.write_all(b"\x93NUMPY\x01\x00")?;
    writer.write_all(&length.to_le_bytes())?;
    writer.write_all(header.as_bytes())?;
    for value in rows.iter().flatten() {
        writer.write_all(&value.to_le_bytes())?;
    }
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_are_those_that_numpy_saves() {
        let rows = vec![vec![1.0, -2.5e-9, f64::MAX], vec![0.1, 1.0 / 3.0, -0.0]];
        let mut bytes = Vec::new();
        write_npy(&rows, &mut bytes).unwrap();
        // numpy.save of the same array, NumPy 2.4: 128 bytes of header, blanks before its newline.
        let known = b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
        assert_eq!(bytes[..known.len()], known[..]);
        assert!(bytes[known.len()..127].iter().all(|byte| *byte == b' ') && bytes[127] == b'\n');
        let back: Vec<u64> =
            bytes[128..].as_chunks::<8>().0.iter().map(|chunk| f64::from_le_bytes(*chunk).to_bits()).collect();
        assert_eq!(back, rows.concat().iter().map(|value| value.to_bits()).collect::<Vec<_>>());
    }

    #[test]
    fn ragged_rows_are_refused() {
        let refusal = write_npy(&[vec![1.0, 2.0], vec![1.0]], Vec::new()).unwrap_err();
        assert!(refusal.to_string().contains("row 1"), "{refusal}");
    }
}
