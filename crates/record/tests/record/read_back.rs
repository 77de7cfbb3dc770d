//! What the program wrote is read back with a limit.

use std::fs::{self, File};

use granchain_record::read_back::{read_back, read_text};

#[test]
#[cfg(unix)]
fn what_is_no_plain_file_or_too_large_is_refused_before_it_is_read() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name);
    let refused = |name: &str| read_back(&path(name), 1 << 20).unwrap_err().to_string();
    fs::write(path("small"), "text").unwrap();
    assert_eq!(read_back(&path("small"), 4).unwrap(), b"text");
    assert!(read_back(&path("small"), 3).unwrap_err().to_string().contains("at most 3 bytes, found 4 bytes"));
    std::os::unix::fs::symlink("/dev/zero", path("zero")).unwrap();
    assert!(refused("zero").contains("a device"));
    assert!(refused(".").contains("a folder"));
    // Sparse: more than any memory holds.
    File::create(path("sparse")).unwrap().set_len(1 << 40).unwrap();
    assert!(refused("sparse").contains("1099511627776 bytes"));
    assert!(std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
    assert!(refused("pipe").contains("pipe"));
    assert!(refused("absent").contains("os error 2"));
    assert_eq!(read_text(&path("small")).unwrap(), "text");
    assert!(read_text(&path("zero")).unwrap_err().to_string().contains("at most 67108864 bytes, found more"));
}
