//! Tables as text, for terminals and as Markdown.

/// Formats a table in a `style`. The first column is left-aligned, the others right.
///
/// # Panics
/// When a row has fewer cells than the header.
pub fn table(header: &[&str], rows: &[Vec<String>], style: Style) -> String {
    let columns = header.len();
    let width = |c: usize| {
        let cells = rows.iter().map(|r| r[c].chars().count());
        cells.chain([header[c].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |cells: Vec<&str>| {
        let padded = cells.iter().enumerate().map(|(c, cell)| match c {
            0 => format!("{cell:<0$}", widths[c]),
            _ => format!("{cell:>0$}", widths[c]),
        });
        let padded: Vec<String> = padded.collect();
        match style {
            Style::Text => format!("{}\n", padded.join("  ").trim_end()),
            Style::Markdown => format!("| {} |\n", padded.join(" | ")),
        }
    };
    let mut text = line(header.to_vec());
    if style == Style::Markdown {
        let dashes: Vec<String> =
            (0..columns).map(|c| if c == 0 { "---".into() } else { "---:".into() }).collect();
        text += &format!("|{}|\n", dashes.join("|"));
    }
    rows.iter().for_each(|row| text += &line(row.iter().map(String::as_str).collect()));
    text
}

/// Format of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Columns of spaces.
    Text,
    /// A Markdown table.
    Markdown,
}

/// A number with `digits` decimals; a dash for none, `inf` for infinity.
pub fn number(value: impl Into<Option<f64>>, digits: usize) -> String {
    value.into().map_or_else(|| "-".into(), |v| format!("{v:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [vec!["a".to_owned(), number(1.0, 2)], vec!["µµµ".to_owned(), number(None, 2)]];
        assert_eq!(table(&["", "x"], &rows, Style::Text), "        x\na    1.00\nµµµ     -\n");
        let markdown = table(&["", "x"], &rows, Style::Markdown);
        assert_eq!(markdown, "|     |    x |\n|---|---:|\n| a   | 1.00 |\n| µµµ |    - |\n");
    }
}
