//! One HTML page with everything in it.

use base64::{Engine, engine::general_purpose::STANDARD};
use granchain_signal::{sha256_bytes, visible, visible_json};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Block, Drawn, Page, TIMES, Table, Tone, curves};
use crate::{
    figure::{COLUMN_WIDTH_MM, embedded_font},
    motion::Motion,
};

const STYLE: &str = include_str!("style.css");
/// uPlot 1.6.32, © Leon Sorokin, MIT: see `assets/`.
const PLOT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const PLOT_LICENCE: &str = include_str!("../../assets/uplot/LICENSE");
const EXPLORE: &str = include_str!("explore.js");
const TABLES: &str = include_str!("tables.js");
const MOTION: &str = include_str!("motion.js");

/// A page with more headings than this begins with a list of them.
const FEW_HEADINGS: usize = 3;
/// A table of more rows than this can be folded.
const LONG_TABLE: usize = 15;
/// A table of more rows than this is folded at first.
const FOLDED_TABLE: usize = 60;

pub(super) fn render(page: &Page, drawn: &[Drawn<'_>]) -> String {
    let curves = curves::of(drawn).map(|curves| visible_json(&curves).into_owned());
    let style =
        STYLE.replace("FONT", &STANDARD.encode(embedded_font())) + if curves.is_some() { PLOT_STYLE } else { "" };
    let scripts = scripts(page, curves.is_some());
    let mut state = State { plates: drawn.iter(), headings: 0 };
    // The answer comes before the list of what follows.
    let lead = usize::from(matches!(page.blocks.first(), Some(Block::Headline { .. })));
    let (lead, rest) = page.blocks.split_at(lead);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy(&style, &scripts));
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (page.title) }
                style { (PreEscaped(style)) }
            }
            body {
                main {
                    h1 { (page.title) }
                    p.subtitle { (page.subtitle) }
                    @for block in lead { (state.block(block)) }
                    (contents(page))
                    @for block in rest { (state.block(block)) }
                }
                @if let Some(curves) = curves { script type="application/json" id="curves" { (PreEscaped(curves)) } }
                @for script in scripts { script { (PreEscaped(script)) } }
            }
        }
    };
    let mut text = visible(&markup.into_string()).into_owned();
    text.push('\n');
    text
}

/// What the page may load and run: this style and these scripts, the font and pictures that are in it, nothing from elsewhere.
fn policy(style: &str, scripts: &[String]) -> String {
    let hash = |text: &str| format!("'sha256-{}'", STANDARD.encode(sha256_bytes(text.as_bytes())));
    let scripts: Vec<String> = scripts.iter().map(|script| hash(script)).collect();
    let scripts = if scripts.is_empty() { "'none'".to_owned() } else { scripts.join(" ") };
    format!("default-src 'none'; style-src {}; script-src {scripts}; font-src data:; img-src data:", hash(style))
}

fn contents(page: &Page) -> Markup {
    let heading = |block: &Block| if let Block::Heading(text) = block { Some(text.clone()) } else { None };
    let headings: Vec<String> = page.blocks.iter().filter_map(heading).collect();
    html! {
        @if headings.len() > FEW_HEADINGS {
            nav.contents aria-label="Contents" {
                ul { @for (index, text) in headings.iter().enumerate() { li { a href={ "#s" (index + 1) } { (prose(text)) } } } }
            }
        }
    }
}

/// What a page has to run: nothing where there is nothing to do.
fn scripts(page: &Page, curves: bool) -> Vec<String> {
    let has = |wanted: fn(&Block) -> bool| page.blocks.iter().any(wanted);
    let tables = has(|block| matches!(block, Block::Table(_) | Block::Timed(_))).then(|| TABLES.to_owned());
    let motion = has(|block| matches!(block, Block::Motion(_))).then(|| MOTION.to_owned());
    let plots = curves.then(|| [format!("/*\n{PLOT_LICENCE}*/\n{PLOT}"), EXPLORE.to_owned()]);
    tables.into_iter().chain(motion).chain(plots.into_iter().flatten()).collect()
}

/// What has been shown so far.
struct State<'a> {
    plates: std::slice::Iter<'a, Drawn<'a>>,
    headings: usize,
}

impl State<'_> {
    fn block(&mut self, block: &Block) -> Markup {
        match block {
            Block::Headline { tone, verdict, text } => {
                let tone = match tone {
                    Tone::Good => "good",
                    Tone::Careful => "careful",
                    Tone::Bad => "bad",
                };
                html! { p class={ "headline " (tone) } { strong { (prose(verdict)) } (prose(text)) } }
            }
            Block::Notice(statements) => html! {
                @if let [first, rest @ ..] = statements.as_slice() {
                    div.notice {
                        p { (prose(first)) }
                        @if !rest.is_empty() { ul { @for statement in rest { li { (prose(statement)) } } } }
                    }
                }
            },
            Block::Heading(text) => {
                self.headings += 1;
                html! { h2 id={ "s" (self.headings) } { (prose(text)) } }
            }
            Block::Paragraph(text) => html! { p { (prose(text)) } },
            Block::List(items) => html! { ul { @for item in items { li { (prose(item)) } } } },
            Block::Facts(facts) => html! {
                dl.facts { @for (name, value) in facts { dt { (prose(name)) } dd { (prose(value)) } } }
            },
            Block::Table(table) => render_table(table),
            Block::Timed(table) => html! { (PreEscaped(TIMES[0])) (render_table(table)) (PreEscaped(TIMES[1])) },
            Block::Plates(list) => html! {
                div.plates { @for plate in self.plates.by_ref().take(list.len()) { (render_plate(plate)) } }
            },
            Block::Motion(motion) => render_motion(motion),
            Block::Code(text) => html! { pre { (text) } },
        }
    }
}

fn render_plate(drawn: &Drawn<'_>) -> Markup {
    let figure = &drawn.plate.figure;
    let wide = figure.width_mm > 1.2 * COLUMN_WIDTH_MM;
    let explorable = curves::is_explorable(figure).then(|| drawn.number.to_string());
    html! {
        figure.wide[wide] data-curves=[explorable] {
            // A wide sheet scrolls on a narrow screen.
            div.sheet tabindex=[wide.then_some("0")] role=[wide.then_some("group")]
                aria-label=[wide.then(|| format!("Figure {}", drawn.number))] { (PreEscaped(&drawn.svg)) }
            figcaption { b { "Figure " (drawn.number) ". " } (prose(&drawn.plate.caption)) }
        }
    }
}

fn render_motion(motion: &Motion) -> Markup {
    html! {
        figure.wide.motion data-motion=(motion.data) {
            div.sheet tabindex="0" role="group" aria-label="The chain in motion" { (PreEscaped(&motion.svg)) }
            figcaption { b { "Motion. " } (prose(&motion.caption)) }
        }
    }
}

fn render_table(table: &Table) -> Markup {
    let rows = table.rows.len();
    html! {
        @if rows > LONG_TABLE {
            details open[rows <= FOLDED_TABLE] {
                summary { "Table of " (rows) " rows" }
                (table_itself(table))
            }
        } @else {
            (table_itself(table))
        }
    }
}

fn table_itself(table: &Table) -> Markup {
    html! {
        div.scroll tabindex="0" role="group" aria-label="Table" {
            table {
                caption { (prose(&table.caption)) }
                thead {
                    tr {
                        @for column in &table.columns {
                            th.number[column.numeric] scope="col" { (prose(&column.head())) }
                        }
                    }
                }
                tbody {
                    @for row in table.aligned() {
                        tr {
                            @for (cell, column) in row.iter().zip(&table.columns) {
                                td.number[column.numeric].digest[is_digest(cell)] { (prose(cell)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Text with what stands between two backticks set as code; a number and its percent sign stay on one line.
fn prose(text: &str) -> Markup {
    let text = text.replace(" %", "\u{a0}%");
    let parts: Vec<&str> = text.split('`').collect();
    html! {
        // Every opened quotation is closed where the parts are odd in number.
        @if parts.len() % 2 == 1 {
            @for (index, part) in parts.iter().enumerate() { @if index % 2 == 1 { code { (part) } } @else { (part) } }
        } @else {
            (text)
        }
    }
}

/// 64 hexadecimal digits would stretch any table.
fn is_digest(cell: &str) -> bool {
    cell.len() == 64 && cell.bytes().all(|byte| byte.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plotting_script_is_the_pinned_one() {
        let sums = include_str!("../../assets/SHA256SUMS");
        let files = [("LICENSE", PLOT_LICENCE), ("uPlot.iife.min.js", PLOT), ("uPlot.min.css", PLOT_STYLE)];
        for (name, text) in files {
            let line = format!("{}  uplot/{name}", granchain_signal::sha256(text.as_bytes()));
            assert!(sums.lines().any(|known| known == line), "{name}: run crates/report/assets/update");
        }
        let package: serde_json::Value = serde_json::from_str(include_str!("../../assets/package.json")).unwrap();
        let version = package["dependencies"]["uplot"].as_str().unwrap();
        assert!(PLOT.contains(&format!("(v{version})")), "{version}");
    }

    #[test]
    fn a_page_runs_its_own_scripts_alone_and_shows_what_would_steer_it() {
        let table = Table { caption: "a\u{202e}b".into(), columns: Vec::new(), rows: Vec::new() };
        let page = Page { title: "x\u{2028}y".into(), subtitle: String::new(), blocks: vec![Block::Table(table)] };
        let text = render(&page, &[]);
        let inside = |tag: &str| {
            let (begin, end) = (format!("<{tag}>"), format!("</{tag}>"));
            text.split(&begin).skip(1).map(|rest| rest.split(&end).next().unwrap().to_owned()).collect::<Vec<_>>()
        };
        let policy = text.split("Content-Security-Policy\" content=\"").nth(1).unwrap().split('"').next().unwrap();
        let scripts = inside("script");
        assert_eq!(scripts, [TABLES]);
        assert_eq!(inside("style").len(), 1);
        for own in scripts.iter().chain(&inside("style")) {
            let hash = STANDARD.encode(sha256_bytes(own.as_bytes()));
            assert!(policy.replace("&#39;", "'").contains(&format!("'sha256-{hash}'")), "{policy}");
        }
        assert!(policy.starts_with("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
        assert!(
            text.contains("x\\u{2028}y") && text.contains("a\\u{202e}b") && !text.contains(['\u{202e}', '\u{2028}'])
        );
    }

    #[test]
    fn backticks_become_code_and_a_lone_one_stays() {
        assert_eq!(prose("the scene `annulus` of <6> beads").0, "the scene <code>annulus</code> of &lt;6&gt; beads");
        assert_eq!(prose("a ` b").0, "a ` b");
    }
}
