//! The bytes of a Gmsh file as nodes, lines and surface elements with their numbers.
//!
//! `mshio` reads entities, nodes and elements. It drops node numbers where they are dense, though not necessarily in order, and skips
//! `$PhysicalNames`: both are put right here.

use std::collections::BTreeMap;

use mshio::MshFile;

use super::GmshError;

type Names = BTreeMap<(i32, i32), String>;

pub(super) struct File {
    pub msh: MshFile<u64, i32, f64>,
    pub names: Names,
}

impl File {
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, GmshError> {
        let encoding = encoding(bytes)?;
        let names = physical_names(bytes)?;
        let (_, [_, elements, ..]) = header(bytes, "Elements", encoding)?;
        let (start, [blocks, nodes, smallest, _]) = header(bytes, "Nodes", encoding)?;
        // mshio takes one from both.
        if nodes == 0 || elements == 0 {
            return Err(GmshError::NoElements);
        }
        let bytes = with_largest_node(bytes, start, encoding, [blocks, nodes, smallest]);
        let msh = mshio::parse_msh_bytes(&bytes).map_err(|error| {
            let kinds: Vec<_> = error.begin_msh_errors().collect();
            let rest = kinds.first().map_or(0, |(rest, _)| rest.len());
            let mut place: Vec<String> = kinds.iter().rev().map(|(_, kind)| kind.to_string()).collect();
            place.dedup();
            GmshError::Syntax { offset: bytes.len() - rest, place: place.join(", ") }
        })?;
        Ok(Self { msh, names })
    }
}

#[derive(Clone, Copy)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The first section: version, text or binary, and what mshio would stumble over refused.
fn encoding(bytes: &[u8]) -> Result<Encoding, GmshError> {
    let mut rest = bytes;
    let mut line = || {
        let end = rest.iter().take(80).position(|byte| *byte == b'\n').unwrap_or(rest.len().min(80));
        let line = String::from_utf8_lossy(&rest[..end]).trim().to_owned();
        rest = rest.get(end + 1..).unwrap_or_default();
        line
    };
    let (tag, numbers) = (line(), line());
    let words: Vec<&str> = numbers.split_whitespace().collect();
    match (tag.as_str(), &words[..], rest) {
        ("$MeshFormat", ["4.1", "0", "8"], _) => Ok(Encoding::Text),
        ("$MeshFormat", ["4.1", "1", "8"], [1, 0, 0, 0, ..]) => Ok(Encoding::LittleEndian),
        ("$MeshFormat", ["4.1", "1", "8"], [0, 0, 0, 1, ..]) => Ok(Encoding::BigEndian),
        _ => Err(GmshError::Version { found: format!("{tag} {numbers}").trim().to_owned() }),
    }
}

fn content(bytes: &[u8], section: &str) -> Option<usize> {
    let tag = format!("\n${section}");
    let at = bytes.windows(tag.len()).position(|window| window == tag.as_bytes())?;
    let line = bytes[at + 1..].iter().position(|byte| *byte == b'\n')?;
    Some(at + 1 + line + 1)
}

/// `$PhysicalNames`, text in binary files too: their number, then `dimension number "name"` a line.
fn physical_names(bytes: &[u8]) -> Result<Names, GmshError> {
    let mut names = Names::new();
    let Some(start) = content(bytes, "PhysicalNames") else { return Ok(names) };
    let mut offset = start;
    for (index, line) in bytes[start..].split(|byte| *byte == b'\n').enumerate() {
        let text = String::from_utf8_lossy(line);
        let text = text.trim();
        if text.starts_with("$EndPhysicalNames") {
            return Ok(names);
        }
        if index > 0 && !text.is_empty() {
            let mut words = text.splitn(3, char::is_whitespace);
            let mut number = || words.next()?.parse::<i32>().ok();
            let (dimension, group) = (number(), number());
            let name = words.next().map(|name| name.trim().trim_matches('"').to_owned());
            let (Some(dimension), Some(group), Some(name)) = (dimension, group, name) else {
                return Err(GmshError::Syntax { offset, place: format!("$PhysicalNames, line `{text}`") });
            };
            names.insert((dimension, group), name);
        }
        offset += line.len() + 1;
    }
    Err(GmshError::Syntax { offset: bytes.len(), place: "$PhysicalNames, which does not end".to_owned() })
}

/// Begin and the four numbers (blocks, items, smallest, largest number) of the header of `$Nodes` or `$Elements`.
fn header(bytes: &[u8], section: &'static str, encoding: Encoding) -> Result<(usize, [u64; 4]), GmshError> {
    let start = content(bytes, section).ok_or(GmshError::MissingSection { section })?;
    let broken = || GmshError::Syntax { offset: start, place: format!("header of ${section}") };
    let mut numbers = [0; 4];
    if let Encoding::Text = encoding {
        let line = bytes[start..].split(|byte| *byte == b'\n').next().unwrap_or_default();
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        for number in &mut numbers {
            *number = words.next().and_then(|word| word.parse().ok()).ok_or_else(broken)?;
        }
    } else {
        let header = bytes.get(start..start + 32).ok_or_else(broken)?;
        for (number, chunk) in numbers.iter_mut().zip(header.chunks_exact(8)) {
            let mut eight = [0; 8];
            eight.copy_from_slice(chunk);
            let little = matches!(encoding, Encoding::LittleEndian);
            *number = if little { u64::from_le_bytes(eight) } else { u64::from_be_bytes(eight) };
        }
    }
    Ok((start, numbers))
}

/// The file with the largest node number overstated, so that mshio keeps the numbers of all nodes.
fn with_largest_node(bytes: &[u8], start: usize, encoding: Encoding, [blocks, nodes, smallest]: [u64; 3]) -> Vec<u8> {
    let largest = u64::MAX >> 1;
    let (header, end) = match encoding {
        Encoding::Text => {
            let length = bytes[start..].iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len() - start);
            (format!("{blocks} {nodes} {smallest} {largest}").into_bytes(), start + length)
        }
        Encoding::LittleEndian => ([blocks, nodes, smallest, largest].map(u64::to_le_bytes).concat(), start + 32),
        Encoding::BigEndian => ([blocks, nodes, smallest, largest].map(u64::to_be_bytes).concat(), start + 32),
    };
    [&bytes[..start], &header, &bytes[end..]].concat()
}
