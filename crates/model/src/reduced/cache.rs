//! Reduced bodies, and the chain's laws of rings, kept in a folder from one run of the program to the next.
//!
//! A file is named by the SHA-256 of everything its content follows from: meshes, materials, interface, settings and the version of the
//! program. It begins with a line that holds the SHA-256 of the rest; a file that does not agree with it, or cannot be read as what it should be, is
//! made again. Files appear whole, by renaming, so that several programs may share a folder. Numbers are kept to the bit. A folder holds 2 GiB at most:
//! what was used longest ago goes first.

use std::{
    fs, io,
    io::Write,
    path::{Path, PathBuf},
    time::SystemTime,
};

use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use super::reduction::{Reduction, plain};
use crate::{
    ModelError,
    chain::FiniteBodyLaws,
    fea::{
        FeaError,
        arrangement::{bead_mesh, support_mesh},
        mesh::Mesh,
    },
    scene::{Material, Scene},
    vector_unit,
};
use granchain_signal::{hexadecimal, read_back::read_back, sha256};

/// Raise it when anything changes that the numbers of a [`Reduction`] follow from; the version of the program does so with a release.
const GENERATION: u32 = 3;
const HEADER: &str = "granchain reduction";
const NAME: (&str, &str) = ("reduction-", ".json");
/// The same of contact laws; raise the number with anything that a fit of [`FiniteBodyLaws`] follows from.
const LAWS_HEADER: &str = "granchain contact laws 1";
const LAWS: &str = "contact-laws-";
const PART: &str = ".reduction-";
/// Most that a folder holds, bytes; at a mesh density of 12 a chain takes half a megabyte.
const LARGEST: u64 = 2 << 30;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
    /// Most that it holds, bytes.
    largest: u64,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    Made { not_kept: Option<String> },
    Read { path: PathBuf },
}

impl Cache {
    /// In that folder, which is made when first needed.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), largest: LARGEST }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The reduced bodies of a scene: from the folder if it holds them, else made and kept there. That they cannot be kept is no error.
    pub(crate) fn reduction(&self, scene: &Scene) -> Result<(Reduction, Origin), ModelError> {
        let key = key(scene)?;
        let path = self.folder.join(format!("{}{key}{}", NAME.0, NAME.1));
        if let Some(reduction) = read::<Reduction>(&path, HEADER, &key) {
            used(&path);
            return Ok((reduction, Origin::Read { path }));
        }
        let reduction = Reduction::new(scene)?;
        let not_kept = self.keep(&path, HEADER, &key, &reduction).err();
        let not_kept = not_kept.map(|error| format!("{}: reduced bodies cannot be kept: {error}", path.display()));
        Ok((reduction, Origin::Made { not_kept }))
    }

    /// The contact laws of a scene: from the folder if it holds them, else fitted and kept there. That they cannot be kept is no error.
    pub(crate) fn contact_laws(&self, scene: &Scene) -> Result<FiniteBodyLaws, ModelError> {
        let key = key(scene)?;
        let factor = scene.support.stiffness().map(f64::to_bits);
        let key = sha256(
            format!("{key} {} {factor:?} {:?} {:?}", scene.contact_law.name(), scene.piston, scene.piston_material)
                .as_bytes(),
        );
        let path = self.folder.join(format!("{LAWS}{key}{}", NAME.1));
        if let Some(laws) = read(&path, LAWS_HEADER, &key).filter(|laws: &FiniteBodyLaws| laws.is_of(scene)) {
            used(&path);
            return Ok(laws);
        }
        let laws = FiniteBodyLaws::fit(scene)?;
        // A fit that is made again costs a fifth of a second.
        let _ = self.keep(&path, LAWS_HEADER, &key, &laws);
        Ok(laws)
    }

    fn keep(&self, path: &Path, header: &str, key: &str, kept: &impl Serialize) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        self.sweep()?;
        let body = serde_json::to_string(kept)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(PART);
        #[cfg(unix)]
        {
            // rw-rw-rw- less the umask: a folder may be shared.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(&self.folder)?;
        // Where files cannot be locked, none is swept either.
        let _ = file.as_file().try_lock();
        writeln!(file, "{header} {key} {}", sha256(body.as_bytes()))?;
        file.write_all(body.as_bytes())?;
        file.flush()?;
        file.persist(path)?;
        self.make_room(path)
    }

    /// Remove what was used longest ago until the rest is small enough; `kept` stays.
    fn make_room(&self, kept: &Path) -> io::Result<()> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let is_ours = path.file_name().and_then(|name| name.to_str()).is_some_and(|name| {
                let rest = name.strip_prefix(NAME.0).or_else(|| name.strip_prefix(LAWS));
                rest.and_then(|rest| rest.strip_suffix(NAME.1)).is_some_and(is_digest)
            });
            // Another program may have removed it meanwhile.
            if is_ours && let Ok(file) = fs::symlink_metadata(&path) {
                files.push((file.modified()?, file.len(), path));
            }
        }
        files.sort();
        let mut total: u64 = files.iter().map(|(_, length, _)| length).sum();
        for (_, length, path) in files.iter().filter(|(_, _, path)| path != kept) {
            if total <= self.largest {
                break;
            }
            match fs::remove_file(path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => total -= length,
            }
        }
        Ok(())
    }

    /// Remove the files that dead programs were writing; those of live ones are locked.
    fn sweep(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let is_part = path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with(PART));
            if is_part && fs::File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
                // What cannot be removed harms nobody.
                let _ = fs::remove_file(&path);
            }
        }
        Ok(())
    }
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Kept for having been used; where that cannot be noted a file goes the sooner.
fn used(path: &Path) {
    let _ = fs::File::open(path).and_then(|file| file.set_modified(SystemTime::now()));
}

/// The file's content if it is whole and of that key.
fn read<T: DeserializeOwned>(path: &Path, header: &str, key: &str) -> Option<T> {
    let text = String::from_utf8(read_back(path, LARGEST).ok()?).ok()?;
    let (found, body) = text.split_once('\n')?;
    if found != format!("{header} {key} {}", sha256(body.as_bytes())) {
        return None;
    }
    serde_json::from_str(body).ok()
}

/// SHA-256 of everything the reduced bodies of a scene follow from.
fn key(scene: &Scene) -> Result<String, FeaError> {
    let scene = plain(scene);
    let mut digest = Sha256::new();
    digest.update(format!("{HEADER} {} {GENERATION} {}\n", env!("CARGO_PKG_VERSION"), vector_unit()));
    digest.update(format!("{:?} modes {}\n", scene.model.meshing(), scene.model.reduced.modes));
    let mut known = Vec::new();
    for bead in &scene.chain.beads {
        let kind = known.iter().position(|other| *other == bead).unwrap_or(known.len());
        digest.update(format!("bead {kind} {:x}\n", bead.radius.to_bits()));
        if kind == known.len() {
            known.push(bead);
            add(&mut digest, &bead_mesh(bead, &scene).map_err(FeaError::from)?, &bead.material);
        }
    }
    digest.update(format!("piston {:?}\n", scene.piston));
    // A spring is no part of the bodies.
    let support = match (scene.support.flat(), scene.support.disc()) {
        _ if scene.support.spring().is_some() => "flat on a spring".to_owned(),
        // Bodies that end at a rigid flat are those that end free: no run presses their last contact.
        (Some(flat), _) => format!("{flat:?}"),
        (None, Some((shape, _))) => format!("disc, rim {}", shape.rim.name()),
        (None, None) => "body".to_owned(),
    };
    digest.update(format!("support {support}\n"));
    if let Some((mesh, material)) = support_mesh(&scene)? {
        add(&mut digest, &mesh, &material);
    }
    Ok(hexadecimal(&digest.finalize()))
}

fn add(digest: &mut Sha256, mesh: &Mesh, material: &Material) {
    digest.update(format!("mesh {} {}\n", mesh.nodes.len(), mesh.elements.len()));
    for place in mesh.nodes.iter().flatten() {
        digest.update(place.to_le_bytes());
    }
    mesh.elements.iter().flatten().for_each(|node| digest.update(node.to_le_bytes()));
    for boundary in &mesh.boundaries {
        digest.update(format!("boundary {} {}\n", boundary.name, boundary.nodes.len()));
        boundary.nodes.iter().for_each(|node| digest.update(node.to_le_bytes()));
    }
    let bits = [material.youngs_modulus, material.poissons_ratio, material.density].map(f64::to_bits);
    digest.update(format!("material {bits:x?}\n"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    fn scene(overrides: &[&str]) -> Scene {
        let base = ["model.kind=reduced", "model.mesh_density=3", "model.modes=2"];
        let all: Vec<String> = base.iter().chain(overrides).map(|text| (*text).to_owned()).collect();
        scene::load("annulus", &all).unwrap()
    }

    #[test]
    fn what_is_read_is_what_was_kept_to_the_bit() {
        let place = tempfile::tempdir().unwrap();
        let cache = Cache::new(place.path().join("deep/folder"));
        let (made, origin) = cache.reduction(&scene(&[])).unwrap();
        assert_eq!(origin, Origin::Made { not_kept: None });
        let (read, origin) = cache.reduction(&scene(&[])).unwrap();
        assert!(matches!(origin, Origin::Read { .. }));
        assert_eq!(made, read);
        assert_eq!(read, Reduction::new(&scene(&[])).unwrap());
        // What a run changes by itself needs no other bodies.
        for same in ["support.stiffness_factor=1.3", "alpha=2", "damping.coefficient=1", "model.step=10 ns"] {
            assert!(matches!(cache.reduction(&scene(&[same])).unwrap().1, Origin::Read { .. }), "{same}");
        }
    }

    fn ring(overrides: &[&str]) -> Scene {
        let base = ["model.kind=chain", "support.ring_radius=0.6 mm"];
        let all: Vec<String> = base.iter().chain(overrides).map(|text| (*text).to_owned()).collect();
        scene::load("annulus", &all).unwrap()
    }

    #[test]
    fn the_law_of_a_ring_is_made_once_and_read_as_it_was_made() {
        let place = tempfile::tempdir().unwrap();
        let cache = Cache::new(place.path());
        let made = |scene: &Scene| crate::tally::during(|| cache.contact_laws(scene).unwrap());
        let (first, work) = made(&ring(&[]));
        assert_eq!((work.fitted_laws, fs::read_dir(place.path()).unwrap().count()), (1, 1));
        let (read, work) = made(&ring(&[]));
        assert_eq!((read, work.fitted_laws), (first.clone(), 0));
        assert_eq!(first, FiniteBodyLaws::fit(&ring(&[])).unwrap());
        // Numbers of the law, which a change of mesh or statics moves: then raise the number in LAWS_HEADER and note the new ones here.
        let crate::contact_law::Law::Annulus(law) = first.fits[6].law else { panic!("{first:?}") };
        for (found, kept) in [law.constant(), law.slope()].into_iter().zip(KEPT_LAW) {
            assert!((found / kept - 1.0).abs() < 1e-7, "{found:.12e} {kept:.12e}");
        }
        // Whatever the law follows from makes another; what it does not, none.
        let others = ["support.section_radius=0.3 mm", "chain.radius=0.55 mm", "support.material=acrylic"];
        for (number, other) in others.into_iter().enumerate() {
            assert_ne!(made(&ring(&[other])).0.fits[6], first.fits[6], "{other}");
            assert_eq!(fs::read_dir(place.path()).unwrap().count(), number + 2);
        }
        assert_eq!(made(&ring(&["alpha=2", "damping.coefficient=1"])).1.fitted_laws, 0);
        for file in fs::read_dir(place.path()).unwrap() {
            fs::write(file.unwrap().path(), "broken").unwrap();
        }
        assert_eq!(made(&ring(&[])).0, first);
    }

    #[test]
    fn everything_the_numbers_follow_from_makes_another_key() {
        let mut keys = vec![key(&scene(&[])).unwrap()];
        for other in [
            "model.mesh_density=4",
            "model.modes=3",
            "chain.beads=5",
            "chain.radius=0.501 mm",
            "materials.chrome-steel.density=7800 kg/m^3",
            "materials.resin.poissons_ratio=0.3",
            "support.ring_radius=0.56 mm",
            "support.section_radius=0.26 mm",
            "support.kind=rigid",
            "support.kind=spring",
        ] {
            let spring = if other.ends_with("spring") { "support.stiffness=1e6 N/m" } else { other };
            keys.push(key(&scene(&[other, spring])).unwrap());
        }
        let count = keys.len();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), count);
    }

    #[test]
    fn broken_truncated_and_foreign_files_are_made_again() {
        let place = tempfile::tempdir().unwrap();
        let cache = Cache::new(place.path());
        let (made, _) = cache.reduction(&scene(&[])).unwrap();
        let path = fs::read_dir(place.path()).unwrap().next().unwrap().unwrap().path();
        let whole = fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        // A letter of a number near the end.
        let at = whole.len() - 200;
        flipped[at] = if flipped[at] == b'A' { b'B' } else { b'A' };
        let foreign =
            String::from_utf8(whole.clone()).unwrap().replacen("granchain reduction ", "granchain reduction 0", 1);
        for broken in [Vec::new(), whole[..whole.len() / 2].to_vec(), flipped, foreign.into_bytes(), vec![0xff; 100]] {
            fs::write(&path, &broken).unwrap();
            let (again, origin) = cache.reduction(&scene(&[])).unwrap();
            assert_eq!((&again, origin), (&made, Origin::Made { not_kept: None }));
            assert_eq!(fs::read(&path).unwrap(), whole);
        }
    }

    #[test]
    fn what_was_used_longest_ago_goes_when_the_folder_is_full() {
        let place = tempfile::tempdir().unwrap();
        let mut cache = Cache::new(place.path());
        let path = |scene: &Scene| place.path().join(format!("reduction-{}.json", key(scene).unwrap()));
        let scenes = ["model.modes=1", "model.modes=2", "model.modes=3"].map(|modes| scene(&[modes]));
        let foreign = place.path().join("reduction-of-mine.json");
        fs::write(&foreign, "x").unwrap();
        for scene in &scenes[..2] {
            cache.reduction(scene).unwrap();
        }
        for (scene, hours) in scenes[..2].iter().zip([2, 1]) {
            let then = SystemTime::now() - std::time::Duration::from_secs(3600 * hours);
            fs::File::open(path(scene)).unwrap().set_modified(then).unwrap();
        }
        // Used again, it is the younger.
        cache.reduction(&scenes[0]).unwrap();
        cache.largest = 2 * fs::metadata(path(&scenes[0])).unwrap().len() + 20_000;
        let (_, origin) = cache.reduction(&scenes[2]).unwrap();
        assert_eq!(origin, Origin::Made { not_kept: None });
        assert_eq!(scenes.each_ref().map(|scene| path(scene).exists()), [true, false, true]);
        assert!(foreign.exists());
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let readable = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o044;
            // As any file of this process.
            assert_eq!(readable(&path(&scenes[2])), readable(&foreign));
        }
    }

    #[test]
    fn what_a_dead_program_was_writing_is_swept_what_a_live_one_writes_is_not() {
        let place = tempfile::tempdir().unwrap();
        let [dead, live, other] = [".reduction-dead", ".reduction-live", "notes"].map(|name| place.path().join(name));
        for path in [&dead, &live, &other] {
            fs::write(path, "half").unwrap();
        }
        let writing = fs::File::open(&live).unwrap();
        writing.lock().unwrap();
        Cache::new(place.path()).reduction(&scene(&[])).unwrap();
        assert_eq!([&dead, &live, &other].map(|path| path.exists()), [false, true, true]);
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_said_and_no_error() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        fs::write(&file, "").unwrap();
        let (_, origin) = Cache::new(file.join("below")).reduction(&scene(&[])).unwrap();
        assert!(matches!(origin, Origin::Made { not_kept: Some(reason) } if reason.contains("below")));
    }

    #[test]
    fn the_generation_is_raised_with_the_numbers() {
        let reduction = Reduction::new(&scene(&[])).unwrap();
        let face = &reduction.faces[0];
        let found = [face.compliance[0], reduction.kinds[0].squares[0], reduction.kinds[1].squares[0]];
        for (found, kept) in found.iter().zip(KEPT) {
            // Far above what another processor's rounding does to them.
            assert!(
                (found / kept - 1.0).abs() < 1e-7,
                "{found:.12e} {kept:.12e}: raise GENERATION, then note the new numbers here"
            );
        }
    }

    /// C and D (m/N) of a ring of 0.6 mm under a 1 mm steel bead.
    const KEPT_LAW: [f64; 2] = [1.707559261737e-6, 2.198532373013e-7];
    /// S of the innermost point, and the first ω² of bead and annulus.
    const KEPT: [f64; 3] = [1.090426915791e-6, 2.769409608294e14, 2.492478445313e13];
}
