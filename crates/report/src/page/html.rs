//! One HTML page with everything in it.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Block, Drawn, Page, Table, Tone};
use crate::figure::{COLUMN_WIDTH_MM, embedded_font};

const STYLE: &str = include_str!("style.css");

pub(super) fn render(page: &Page, drawn: &[Drawn<'_>]) -> String {
    let style = STYLE.replace("FONT", &base64(embedded_font()));
    let mut plates = drawn.iter();
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (page.title) }
                style { (PreEscaped(style)) }
            }
            body {
                main {
                    h1 { (page.title) }
                    p.subtitle { (page.subtitle) }
                    @for block in &page.blocks { (render_block(block, &mut plates)) }
                }
            }
        }
    };
    let mut text = markup.into_string();
    text.push('\n');
    text
}

fn render_block<'a>(block: &Block, plates: &mut impl Iterator<Item = &'a Drawn<'a>>) -> Markup {
    match block {
        Block::Headline { tone, verdict, text } => {
            let tone = match tone {
                Tone::Good => "good",
                Tone::Careful => "careful",
                Tone::Bad => "bad",
            };
            html! { p class={ "headline " (tone) } { strong { (verdict) } (kept(text)) } }
        }
        Block::Notice(statements) => html! {
            @if let [first, rest @ ..] = statements.as_slice() {
                div.notice {
                    p { (kept(first)) }
                    @if !rest.is_empty() { ul { @for statement in rest { li { (kept(statement)) } } } }
                }
            }
        },
        Block::Heading(text) => html! { h2 { (text) } },
        Block::Paragraph(text) => html! { p { (kept(text)) } },
        Block::List(items) => html! { ul { @for item in items { li { (kept(item)) } } } },
        Block::Facts(facts) => html! {
            dl.facts { @for (name, value) in facts { dt { (name) } dd { (value) } } }
        },
        Block::Table(table) => render_table(table),
        Block::Plates(list) => html! {
            div.plates {
                @for plate in plates.take(list.len()) {
                    figure.wide[plate.plate.figure.width_mm > 1.2 * COLUMN_WIDTH_MM] {
                        (PreEscaped(&plate.svg))
                        figcaption { b { "Figure " (plate.number) ". " } (kept(&plate.plate.caption)) }
                    }
                }
            }
        },
        Block::Code(text) => html! { pre { (text) } },
    }
}

fn render_table(table: &Table) -> Markup {
    html! {
        div.scroll {
            table {
                caption { (kept(&table.caption)) }
                thead {
                    tr {
                        @for column in &table.columns {
                            th.number[column.numeric] scope="col" { (column.head()) }
                        }
                    }
                }
                tbody {
                    @for row in table.aligned() {
                        tr {
                            @for (cell, column) in row.iter().zip(&table.columns) {
                                td.number[column.numeric].digest[is_digest(cell)] { (cell) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A number and its percent sign stay on one line.
fn kept(text: &str) -> String {
    text.replace(" %", "\u{a0}%")
}

/// 64 hexadecimal digits would stretch any table.
fn is_digest(cell: &str) -> bool {
    cell.len() == 64 && cell.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// RFC 4648, §4, with padding.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = group.iter().fold(0_u32, |bits, byte| bits << 8 | u32::from(*byte)) << (8 * (3 - group.len()));
        for index in 0..4 {
            let digit = (bits >> (18 - 6 * index)) & 63;
            text.push(if index <= group.len() { ALPHABET[digit as usize] as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::base64;

    #[test]
    fn base64_gives_the_examples_of_rfc_4648() {
        let pairs = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in pairs {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }
}
