//! The files that a calibration was made from: found again, and known by their digests.

use std::{
    collections::BTreeMap,
    fs,
    path::{Component, Path, PathBuf},
};

use anyhow::{Context, bail};

use crate::{
    calibration::{drive::Input, outcome::InputDigest},
    cli::calibrate::manifest,
};

/// Most files of a folder that are looked at.
const MOST_FILES: usize = 20_000;

/// Check every input where it was when the calibration was made, as seen from the current folder.
pub fn check(inputs: &BTreeMap<String, InputDigest>) -> anyhow::Result<()> {
    for (role, input) in inputs {
        let place = format!("{}: inputs.{role}", manifest::FILE);
        let path = PathBuf::from(&input.path);
        if !path.is_file() && input.path.contains(char::REPLACEMENT_CHARACTER) {
            bail!(
                "{place}.path: the name of the file, {}, was not UTF-8 text, and the manifest cannot name it; give the file a name in UTF-8 and \
                 calibrate again",
                input.path
            );
        }
        if !path.is_file() {
            bail!(
                "{place}.path: expected the file {}, found none; run in the folder that this path is relative to, or name a folder with the files \
                 as --inputs",
                input.path
            );
        }
        let found = Input::digest(path)?.sha256;
        if found != input.sha256 {
            bail!(
                "{place}.sha256: expected {}, found {found}: {} is not the file that was read; get that one, or name a folder with it as --inputs",
                input.sha256,
                input.path
            );
        }
    }
    Ok(())
}

/// Lay out the inputs, found anywhere below `folder` by their digests, as they lay when the calibration was made; `root` becomes that
/// place's parent. Returns the folder to be in.
pub fn stage(inputs: &BTreeMap<String, InputDigest>, folder: &Path, root: &Path) -> anyhow::Result<PathBuf> {
    let known = digests(folder)?;
    let ups = |path: &Path| path.components().filter(|part| *part == Component::ParentDir).count();
    let depth = inputs.values().map(|input| ups(Path::new(&input.path))).max().unwrap_or(0);
    let here = root.join(["below"; 1].repeat(depth + 1).join("/"));
    fs::create_dir_all(&here).with_context(|| format!("{}: cannot be made", here.display()))?;
    for (role, input) in inputs {
        let path = Path::new(&input.path);
        if path.is_absolute() {
            continue;
        }
        let Some(found) = known.get(&input.sha256) else {
            bail!(
                "{}: inputs.{role}.sha256: no file below {} has the SHA-256 {} of {}; ask for that file, or the digest was altered",
                manifest::FILE,
                folder.display(),
                input.sha256,
                input.path
            );
        };
        let target = here.join(path);
        let parent = target.parent().unwrap_or(&here);
        fs::create_dir_all(parent).with_context(|| format!("{}: cannot be made", parent.display()))?;
        fs::copy(found, &target).with_context(|| format!("{}: cannot be copied", found.display()))?;
    }
    Ok(here)
}

/// Every file below a folder by its digest.
fn digests(folder: &Path) -> anyhow::Result<BTreeMap<String, PathBuf>> {
    let mut known = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(place) = open.pop() {
        let entries = fs::read_dir(&place).with_context(|| format!("--inputs {}: cannot be read", place.display()))?;
        for entry in entries {
            let path = entry?.path();
            if path.is_dir() && !path.is_symlink() {
                open.push(path);
            } else if path.is_file() {
                known.insert(Input::digest(path.clone())?.sha256, path);
            }
            if known.len() > MOST_FILES {
                bail!("--inputs {}: more than {MOST_FILES} files; name the folder of the records", folder.display());
            }
        }
    }
    Ok(known)
}
