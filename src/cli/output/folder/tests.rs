use std::{collections::BTreeMap, process::Command, sync::atomic::AtomicUsize};

use super::*;

/// The process ends at this of its instants.
const STOP_AT: &str = "GRANCHAIN_TEST_STOP_AT";
/// Where it works, and how.
const PLACE: &str = "GRANCHAIN_TEST_PLACE";
const WAY: &str = "GRANCHAIN_TEST_WAY";
/// Names are not exchanged.
pub const NO_EXCHANGE: &str = "GRANCHAIN_TEST_NO_EXCHANGE";
/// Exit code of a process that was ended so.
const STOPPED: i32 = 86;

/// Between two changes on disk.
pub fn instant() {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let Ok(stop_at) = std::env::var(STOP_AT) else { return };
    if COUNT.fetch_add(1, std::sync::atomic::Ordering::SeqCst).to_string() == stop_at {
        std::process::exit(STOPPED);
    }
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files_below(folder).unwrap().into_iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect()
}

fn stage(target: &Path, force: bool) -> Result<OutputFolder, OutputError> {
    OutputFolder::stage(target, &[], force)
}

fn resumable(target: &Path, resume: bool, force: bool) -> Result<OutputFolder, OutputError> {
    OutputFolder::resumable(target, &[], "sweep", resume, force)
}

/// Write these files into `target`.
fn output(target: &Path, files: &[&str], force: bool) {
    let folder = stage(target, force).unwrap();
    for file in files {
        folder.write(file, file.as_bytes()).unwrap();
    }
    folder.finish().unwrap();
}

#[test]
fn a_failed_run_leaves_nothing_behind_not_even_new_parents() {
    let place = tempfile::tempdir().unwrap();
    let folder = stage(&place.path().join("a/b/run"), false).unwrap();
    folder.write("x.csv", b"1").unwrap();
    drop(folder);
    assert!(names(place.path()).is_empty());
}

#[test]
fn an_earlier_output_is_replaced_whole() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    for file in ["old.csv", "new.csv"] {
        output(&target, &[file], false);
    }
    assert_eq!(names(&target), [".granchain", "new.csv"]);
    assert_eq!(names(place.path()), ["run"]);
}

#[test]
fn foreign_files_are_refused_and_survive_force() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    fs::create_dir(&target).unwrap();
    fs::write(target.join("thesis.tex"), "years of work").unwrap();
    assert!(matches!(stage(&target, false), Err(OutputError::Foreign { .. })));
    output(&target, &["x.csv", "old/y.csv"], true);
    assert_eq!(names(&target), [".granchain", "old", "thesis.tex", "x.csv"]);
    output(&target, &["x.csv"], true);
    assert!(names(&target.join("old")).is_empty());
    assert_eq!(names(place.path()), ["run"]);
}

#[test]
fn a_resumable_folder_is_kept_found_again_and_guarded() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    assert!(matches!(resumable(&target, true, false), Err(OutputError::NothingToResume { stands: None, .. })));
    let folder = resumable(&target, false, false).unwrap();
    fs::write(folder.state_path().join("runs.jsonl"), "{}\n").unwrap();
    assert!(matches!(resumable(&target, true, false), Err(OutputError::InUse { .. })));
    drop(folder);
    assert!(matches!(resumable(&target, false, false), Err(OutputError::Unfinished { .. })));
    let folder = resumable(&target, true, false).unwrap();
    assert!(folder.state_path().join("runs.jsonl").exists());
    folder.write("x.csv", b"1").unwrap();
    folder.finish().unwrap();
    assert_eq!(names(&target), [".granchain", "x.csv"]);
    assert_eq!(names(place.path()), ["run"]);
    assert!(matches!(resumable(&target, true, false), Err(OutputError::NothingToResume { stands: Some(_), .. })));
}

#[test]
fn a_file_is_no_folder() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    fs::write(&target, "x").unwrap();
    assert!(matches!(stage(&target, true), Err(OutputError::NotAFolder { .. })));
}

#[cfg(unix)]
#[test]
fn a_link_to_nowhere_is_no_folder() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    std::os::unix::fs::symlink("nowhere", &target).unwrap();
    assert!(matches!(stage(&target, true), Err(OutputError::NotAFolder { .. })));
}

#[test]
fn a_result_that_vanished_on_the_way_is_reported_and_nothing_is_published() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let folder = stage(&target, false).unwrap();
    folder.write("fields.pvd", "names frame.vtu").unwrap();
    fs::remove_file(folder.write("frame.vtu", "x").unwrap()).unwrap();
    let error = folder.finish().unwrap_err();
    let OutputError::Unpublished { source, .. } = error else { panic!("{error}") };
    assert!(matches!(*source, OutputError::Vanished { path } if path.ends_with("frame.vtu")));
    assert!(!target.exists());
}

#[test]
fn a_list_that_we_never_write_is_refused_whatever_the_flag() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let victim = place.path().join("victim.txt");
    fs::write(&victim, "x").unwrap();
    let digest = digest("victim.txt", b"x");
    let form = List::default().text();
    let absolute = victim.display().to_string();
    let names = ["../victim.txt", &absolute, "a/../../victim.txt", "./x", "a//b", "a/", "x\u{1b}[2J", "x\r", ""];
    let dated = |line: String| format!("{form}{line}\n");
    let mut lists: Vec<String> = names.iter().map(|name| dated(format!("{digest}  {name}"))).collect();
    lists.extend(names.iter().filter(|name| !name.is_empty()).map(|name| format!("{name}\n")));
    lists.extend(["thesis.tex", "  thesis.tex", "abc  thesis.tex"].map(|line| dated(line.into())));
    for list in lists {
        fs::create_dir_all(&target).unwrap();
        fs::write(target.join(LIST), &list).unwrap();
        for force in [false, true] {
            let refused = stage(&target, force);
            assert!(matches!(refused, Err(OutputError::DamagedList { .. })), "{list:?}: {refused:?}");
        }
        assert!(victim.exists());
    }
}

#[test]
fn a_file_changed_since_is_kept_whatever_the_flag() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    output(&target, &["x.csv"], false);
    fs::write(target.join("x.csv"), "my notes").unwrap();
    for force in [false, true] {
        let refused = stage(&target, force);
        assert!(matches!(&refused, Err(OutputError::Altered { found, .. }) if found == "x.csv"), "{refused:?}");
    }
    assert_eq!(fs::read(target.join("x.csv")).unwrap(), b"my notes");
}

#[test]
fn the_list_does_not_depend_on_times() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let write = || {
        let folder = stage(&target, false).unwrap();
        folder.write("timing.json", crate::cli::timing::Timing::start().to_json()).unwrap();
        folder.finish().unwrap();
        fs::read(target.join(LIST)).unwrap()
    };
    assert!(write() == write());
}

#[test]
fn the_name_of_a_result_that_is_taken_is_refused_at_once_where_it_is_known_and_the_results_are_kept_where_not() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    fs::create_dir(&target).unwrap();
    fs::write(target.join("x.csv"), "mine").unwrap();
    let refused = OutputFolder::stage(&target, &["x.csv"], true);
    assert!(matches!(&refused, Err(OutputError::Taken { found, .. }) if found == "x.csv"), "{refused:?}");
    let folder = stage(&target, true).unwrap();
    folder.write("a.csv", b"1").unwrap();
    folder.write("x.csv", b"2").unwrap();
    let Err(OutputError::Unpublished { place: kept, .. }) = folder.finish() else { panic!("published") };
    assert_eq!(fs::read(kept.join("x.csv")).unwrap(), b"2");
    assert_eq!(contents(&target), BTreeMap::from([("x.csv".into(), b"mine".to_vec())]));
    // Nothing but those, and a next run leaves them alone.
    drop(stage(&target, true).unwrap());
    assert_eq!(names(place.path()), [kept.file_name().unwrap().to_str().unwrap(), "run"]);
}

#[cfg(unix)]
#[test]
fn no_result_is_written_through_a_link() {
    let place = tempfile::tempdir().unwrap();
    let (target, outside) = (place.path().join("run"), place.path().join("outside"));
    fs::create_dir(&target).unwrap();
    fs::create_dir(&outside).unwrap();
    std::os::unix::fs::symlink(&outside, target.join("fields")).unwrap();
    assert!(matches!(stage(&target, false), Err(OutputError::Foreign { .. })));
    let refused = OutputFolder::stage(&target, &["fields/x.csv"], true);
    assert!(matches!(&refused, Err(OutputError::Taken { found, .. }) if found == "fields"), "{refused:?}");
    let folder = stage(&target, true).unwrap();
    folder.write("fields/x.csv", b"1").unwrap();
    assert!(folder.finish().is_err() && names(&outside).is_empty());
}

#[test]
fn the_state_of_another_command_is_refused_and_left_as_it_is() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let folder = resumable(&target, false, false).unwrap();
    fs::write(folder.state_path().join("runs.jsonl"), "{}\n").unwrap();
    folder.write("half.csv", b"1").unwrap();
    drop(folder);
    let before = contents(place.path());
    let refused = OutputFolder::resumable(&target, &[], "calibrate", true, false);
    assert!(matches!(&refused, Err(OutputError::OtherCommand { found, .. }) if found == "sweep"), "{refused:?}");
    drop(refused);
    // Taken up and failed at once: it stays too.
    resumable(&target, true, false).unwrap().discard();
    assert_eq!(contents(place.path()), before);
    // Of a version that did not say.
    fs::remove_file(place.path().join(".run.unfinished/state").join(COMMAND)).unwrap();
    assert!(matches!(resumable(&target, true, false), Err(OutputError::OtherCommand { .. })));
    drop(resumable(&target, false, true).unwrap());
    assert_eq!(names(&place.path().join(".run.unfinished/state")), [COMMAND]);
}

#[test]
fn an_empty_state_starts_again_with_and_without_resume() {
    let place = tempfile::tempdir().unwrap();
    let (target, work) = (place.path().join("run"), place.path().join(".run.unfinished"));
    for left in ["", "state", "state/.granchain-x"] {
        fs::create_dir_all(work.join(left)).unwrap();
        for resume in [true, false] {
            let folder = resumable(&target, resume, false).unwrap();
            assert!(!folder.is_resumed() && !folder.is_saved(), "{left}");
            assert_eq!(names(&work.join(STATE)), [COMMAND]);
        }
    }
    resumable(&target, false, false).unwrap().discard();
    assert!(names(place.path()).is_empty());
}

/// As a process does that is being started when the folder is dropped: until it runs its program it shares every open file.
#[test]
fn a_dropped_folder_is_free_even_if_its_lock_is_still_open_elsewhere() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let folder = resumable(&target, false, false).unwrap();
    let _shared = folder.lock.try_clone().unwrap();
    drop(folder);
    resumable(&target, false, false).unwrap();
}

#[test]
fn nothing_is_published_but_the_files_written() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let folder = stage(&target, false).unwrap();
    let path = folder.write("x.csv", b"1").unwrap();
    fs::write(path.with_file_name(".granchain-abc"), "part").unwrap();
    folder.finish().unwrap();
    assert_eq!(names(&target), [".granchain", "x.csv"]);
}

#[test]
fn what_dead_runs_left_is_swept_what_live_ones_write_is_not() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let live = stage(&target, false).unwrap();
    live.write("x.csv", b"1").unwrap();
    let dead = place.path().join(".run.partial-dead01");
    fs::create_dir_all(dead.join(RESULTS)).unwrap();
    fs::write(dead.join("lock"), "").unwrap();
    fs::write(dead.join(".granchain-abcdef"), "half a list").unwrap();
    fs::create_dir(place.path().join(".run.partial-dead02")).unwrap();
    // Not ours: no lock, or something else in it, or of another target.
    for foreign in [".run.partial-old/x.csv", ".run.partial-mine/notes", ".run.partial-x.unfinished/results"] {
        fs::create_dir_all(place.path().join(foreign)).unwrap();
    }
    fs::write(place.path().join(".run.partial-mine/lock"), "").unwrap();
    let before = names(place.path());
    output(&target, &["y.csv"], false);
    let after = names(place.path());
    let gone: Vec<_> = before.iter().filter(|name| !after.contains(name)).collect();
    assert_eq!(gone, [".run.partial-dead01", ".run.partial-dead02"]);
    live.finish().unwrap();
    assert_eq!(names(&target), [".granchain", "x.csv"]);
}

#[test]
fn two_runs_of_one_target_do_not_meet() {
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("run");
    let folders = [stage(&target, false).unwrap(), stage(&target, false).unwrap()];
    for (number, folder) in folders.into_iter().enumerate() {
        folder.write(format!("{number}.csv"), b"1").unwrap();
        folder.finish().unwrap();
        assert_eq!(names(&target), [".granchain".to_owned(), format!("{number}.csv")]);
    }
    assert_eq!(names(place.path()), ["run"]);
}

/// A run that takes up what it finds and finishes; the body of the process that is ended.
#[test]
fn finish_until_stopped() {
    let (Ok(place), Ok(way)) = (std::env::var(PLACE), std::env::var(WAY)) else { return };
    run(Path::new(&place), &way).unwrap();
}

fn run(place: &Path, way: &str) -> Result<(), OutputError> {
    let (target, force) = (place.join("run"), way.contains("foreign"));
    let folder = if way.contains("resumable") {
        let resume = place.join(".run.unfinished").exists();
        let folder = resumable(&target, resume, force)?;
        let frame = folder.state_path().join("frame.vtu");
        if !frame.exists() {
            write_atomically(&frame, b"frame")?;
        }
        folder.write("fields/frame.vtu", fs::read(&frame).unwrap())?;
        folder
    } else {
        stage(&target, force)?
    };
    folder.write("a.csv", b"new a")?;
    folder.write("c.csv", b"new c")?;
    folder.finish()?;
    Ok(())
}

/// An earlier output in which a file will go, one be replaced and one be added.
fn before(way: &str) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    if !way.contains("first") {
        output(&place.path().join("run"), &["a.csv", "b.csv"], false);
    }
    if way.contains("foreign") {
        fs::create_dir_all(place.path().join("run")).unwrap();
        fs::write(place.path().join("run/thesis.tex"), "years of work").unwrap();
    }
    place
}

#[test]
fn a_process_ended_at_any_instant_of_the_finish_loses_nothing_and_the_next_ends_in_the_same_bytes() {
    for way in ["first", "again", "foreign", "first foreign", "resumable first", "resumable", "resumable foreign"] {
        for exchange in [true, false] {
            let unbroken = before(way);
            run(unbroken.path(), way).unwrap();
            let expected = contents(unbroken.path());
            let mut instants = 0;
            loop {
                let place = before(way);
                let mut process = Command::new(std::env::current_exe().unwrap());
                process.args(["--exact", "cli::output::folder::tests::finish_until_stopped"]);
                process.env(PLACE, place.path()).env(WAY, way).env(STOP_AT, instants.to_string());
                if !exchange {
                    process.env(NO_EXCHANGE, "1");
                }
                let code = process.output().unwrap().status.code();
                let what = format!("{way}, exchange {exchange}, instant {instants}");
                let left = contents(place.path());
                if way.contains("foreign") {
                    assert_eq!(left["run/thesis.tex"], b"years of work", "{what}");
                }
                if way.contains("resumable") {
                    let state = left.get(".run.unfinished/state/frame.vtu");
                    let begun = left.contains_key(".run.unfinished/results/.granchain");
                    assert!(state.is_some() || left.contains_key("run/fields/frame.vtu") || !begun, "{what}: {left:?}");
                }
                if code == Some(0) {
                    assert_eq!(left, expected, "{what}");
                    break;
                }
                assert_eq!(code, Some(STOPPED), "{what}");
                instants += 1;
                run(place.path(), way).unwrap_or_else(|error| panic!("{what}: {error}"));
                assert_eq!(contents(place.path()), expected, "{what}");
                assert!(names(place.path()) == names(unbroken.path()), "{what}: {:?}", names(place.path()));
            }
            assert!(instants >= 5, "{way}: {instants}");
        }
    }
}
