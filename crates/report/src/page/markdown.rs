//! The same report as Markdown, its figures as files beside it.

use std::fmt::Write as _;

use granchain_signal::visible;

use super::{Block, Drawn, Page, TIMES, Table};

pub(super) fn render(page: &Page, drawn: &[Drawn<'_>]) -> String {
    let mut text = format!("# {}\n\n{}\n", escape(&page.title), escape(&page.subtitle));
    let mut plates = drawn.iter();
    for block in &page.blocks {
        text.push('\n');
        render_block(block, &mut plates, &mut text);
    }
    text
}

fn render_block<'a>(block: &Block, plates: &mut impl Iterator<Item = &'a Drawn<'a>>, text: &mut String) {
    // Writing to a String cannot fail.
    let _ = match block {
        Block::Headline { verdict, text: answer, .. } => {
            writeln!(text, "**{}** {}", escape(verdict), escape(answer.trim_start()))
        }
        Block::Notice(statements) => {
            let quoted: Vec<String> = statements.iter().map(|statement| format!("> {}", escape(statement))).collect();
            writeln!(text, "{}", quoted.join("\n>\n"))
        }
        Block::Heading(heading) => writeln!(text, "## {}", escape(heading)),
        Block::Paragraph(paragraph) => writeln!(text, "{}", escape(paragraph)),
        Block::List(items) => items.iter().try_for_each(|item| writeln!(text, "- {}", escape(item))),
        Block::Facts(facts) => {
            facts.iter().try_for_each(|(name, value)| writeln!(text, "- {}: {}", escape(name), escape(value)))
        }
        Block::Table(table) => render_table(table, text),
        Block::Timed(table) => writeln!(text, "{}\n", TIMES[0])
            .and_then(|()| render_table(table, text))
            .and_then(|()| writeln!(text, "\n{}", TIMES[1])),
        Block::Plates(list) => plates.take(list.len()).try_for_each(|plate| {
            let caption = escape(&plate.plate.caption);
            writeln!(text, "![Figure {}](figures/{}.png)\n", plate.number, plate.plate.name)?;
            writeln!(text, "**Figure {}.** {caption}\n", plate.number)
        }),
        Block::Motion(motion) => writeln!(text, "{}", escape(&motion.caption)),
        Block::Code(code) => {
            // A fence longer than any run of back-ticks inside.
            let longest = code.split(|letter| letter != '`').map(str::len).max().unwrap_or(0);
            let fence = "`".repeat((longest + 1).max(3));
            writeln!(text, "{fence}\n{code}\n{fence}")
        }
    };
}

fn render_table(table: &Table, text: &mut String) -> std::fmt::Result {
    writeln!(text, "{}\n", escape(&table.caption))?;
    let heads: Vec<String> = table.columns.iter().map(|column| escape(&column.head())).collect();
    let rules: Vec<&str> = table.columns.iter().map(|column| if column.numeric { "---:" } else { "---" }).collect();
    writeln!(text, "| {} |\n| {} |", heads.join(" | "), rules.join(" | "))?;
    table.rows.iter().try_for_each(|row| {
        let cells: Vec<String> = row.iter().map(|cell| escape(cell)).collect();
        writeln!(text, "| {} |", cells.join(" | "))
    })
}

/// Text that Markdown shows as it is.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in visible(&text.replace(char::is_control, " ")).chars() {
        match letter {
            '\\' | '`' | '*' | '_' | '[' | ']' | '<' | '>' | '|' | '#' | '&' => escaped.extend(['\\', letter]),
            letter => escaped.push(letter),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_file_name_stays_text() {
        assert_eq!(escape("a|b_<i>\n# c"), "a\\|b\\_\\<i\\> \\# c");
    }
}
