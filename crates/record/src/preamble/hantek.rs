use super::{Line, Preamble, cells};

/// `#timebase=80000000(ps)` / `,#voltbase=2000000(uV)` / `#size=4064`, then seconds and millivolts: the keys are settings of the screen.
pub(super) fn hantek(lines: &[Line<'_>]) -> Option<Preamble> {
    let is_key = |line: &&Line<'_>| line.text.trim_start_matches([',', '"', ' ']).starts_with('#');
    let first = lines.iter().find(|line| !is_key(line) && !line.text.trim().is_empty())?;
    let width = cells(first.text).iter().filter(|cell| !cell.is_empty()).count();
    let column = |at: usize| if at == 0 { "time (s)".to_owned() } else { format!("CH{at} (mV)") };
    (width > 1).then(|| Preamble {
        instrument: "Hantek",
        body: first.at,
        body_line: first.number,
        header: Some((0..width).map(column).collect()),
        statements: lines.iter().take_while(|line| line.number < first.number).map(|it| it.text.into()).collect(),
        assumptions: vec!["Hantek writes no units: time taken in s, amplitude in mV".into()],
        ..Preamble::default()
    })
}
