//! Whatever a scene file and its overrides hold, the reader returns: a scene that reads back as itself, or a refusal.
//! `PROPTEST_CASES=100000000` for a long run; `tests/fuzz/` follows the branches taken.

mod allocator;
mod harm;

use std::{
    path::Path,
    time::{Duration, Instant},
};

use granchain::scene::{BUILT_IN, KEYS, load, load_text};
use harm::{cases, harm, harmed};
use proptest::prelude::*;

/// Signs and numbers that mean something in some scene.
fn words() -> Vec<Vec<u8>> {
    let signs =
        ["\n", "=", "\"", "[", "]", "[[", "{", "}", ".", "#", "-", "0", "1e308", "nan", "inf", "9999999999999999999"];
    let units = [" um", " µs", " kHz", " N s/m^1.5", " 1"];
    let own = ["\nextends = \"annulus\"\n", "\n[chain]\nbeads = 1000\n", "\n[[chain.override]]\nbead = 1\n"];
    let keys = KEYS.iter().flat_map(|key| key.name.split('.'));
    signs.into_iter().chain(units).chain(own).chain(keys).map(|word| word.as_bytes().to_vec()).collect()
}

/// Read it; what was read is written and read again.
fn try_text(text: &str, overrides: &[String]) -> bool {
    let path = Path::new("/lab/own.toml");
    let (read, peak) = allocator::peak_of(|| load_text(text, path, overrides));
    let size = text.len() + overrides.iter().map(String::len).sum::<usize>();
    assert!(peak <= 10 * size + allocator::ANY_SCENE, "{peak} bytes of memory for {size}");
    let Ok(loaded) = read else { return false };
    let written = loaded.scene.to_toml();
    let again = load_text(&written, path, &[]).unwrap_or_else(|error| panic!("{error}\n{written}"));
    assert_eq!(again.scene.to_toml(), written);
    true
}

#[test]
fn the_built_in_scenes_are_read_as_they_are() {
    assert!(BUILT_IN.len() >= 4);
    for scene in BUILT_IN {
        assert!(try_text(scene.toml, &[]), "{}", scene.name);
    }
}

/// A megabyte of values, of lines, of tables: time and memory in proportion, where each place was once counted from the start of the file.
#[test]
fn a_megabyte_is_refused_at_once() {
    let many = |count: usize, item: &dyn Fn(usize) -> String| (0..count).map(item).collect::<String>();
    let zeros = many(500_000, &|_| "0,".into());
    let lines = many(330_000, &|_| "0,\n".into());
    for text in [
        format!("extends = \"rigid\"\nchain.gaps = [{zeros}]\n"),
        format!("extends = \"rigid\"\nchain.gaps = [\n{lines}]\n"),
        format!("extends = \"rigid\"\nalpha = [{}]\n", ",".repeat(1_000_000)),
        format!("alpha = {}", "[".repeat(1_000_000)),
        many(30_000, &|bead| format!("[[chain.override]]\nbead = {bead}\n")),
        many(38_000, &|index| format!("materials.a{index:x}.density = 1\n")),
        many(90_000, &|index| format!("b{index:x} = 1\n")),
        many(50_000, &|index| format!("chain.gaps.contact{index} = 1\n")),
    ] {
        let begin = Instant::now();
        let (read, peak) = allocator::peak_of(|| load_text(&text, Path::new("own.toml"), &[]));
        assert!(read.is_err());
        let start = &text[..40];
        // A value of one digit and its comma becomes a value with its place. What counted quadratically took minutes.
        let factor = peak as f64 / text.len() as f64;
        println!("{:.3} s, {factor:.1} times, {start:?}", begin.elapsed().as_secs_f64());
        assert!(factor < 150.0, "{factor} times, {start}");
        assert!(begin.elapsed() < Duration::from_secs(20), "{start}");
    }
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn harmed_scenes_are_read_or_refused(
        scene in prop::sample::select(&BUILT_IN),
        harms in prop::collection::vec(harm(words()), 1..6),
        key in prop::sample::select(KEYS),
        value in prop::option::of("[0-9a-z. -]{0,8}"),
    ) {
        let text = harmed(scene.toml.as_bytes(), &harms);
        let overrides: Vec<String> = value.iter().map(|value| format!("{}={value}", key.name)).collect();
        try_text(&String::from_utf8_lossy(&text), &overrides);
    }
}

proptest! {
    #![proptest_config(cases(4000))]

    #[test]
    fn any_text_and_any_override_are_read_or_refused(text in "[a-z.=\\[\\]{}\"\n 0-9-]{0,60}", value in "\\PC{0,12}") {
        try_text(&text, &[]);
        for key in KEYS {
            let _ = load("annulus", &[format!("{}={value}", key.name.replace('*', "chrome-steel"))]);
        }
    }
}
