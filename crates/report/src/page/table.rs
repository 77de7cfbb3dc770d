//! Tables with units in their heads and numbers aligned at the decimal point.

#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub title: String,
    /// Unit of the whole column, if it has one.
    pub unit: Option<String>,
    /// Whether its cells are numbers.
    pub numeric: bool,
}

impl Column {
    #[must_use]
    pub fn words(title: impl Into<String>) -> Self {
        Self { title: title.into(), unit: None, numeric: false }
    }

    #[must_use]
    pub fn numbers(title: impl Into<String>) -> Self {
        Self { title: title.into(), unit: None, numeric: true }
    }

    /// The same column with one unit for all its cells.
    #[must_use]
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { unit: Some(unit.into()), ..self }
    }

    /// Title and unit.
    #[must_use]
    pub fn head(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} ({unit})", self.title),
            None => self.title.clone(),
        }
    }
}

/// A table; every row has as many cells as there are columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub caption: String,
    pub columns: Vec<Column>,
    /// Cells, row by row, numbers already formatted.
    pub rows: Vec<Vec<String>>,
}

const FIGURE_SPACE: char = '\u{2007}';
const POINT_SPACE: char = '\u{2008}';

impl Table {
    /// Cells with the numbers of each column padded behind so that, set flush right in figures of one width, their decimal
    /// points stand below each other.
    pub(super) fn aligned(&self) -> Vec<Vec<String>> {
        let mut rows = self.rows.clone();
        for (index, _) in self.columns.iter().enumerate().filter(|(_, column)| column.numeric) {
            let decimals = |cell: &str| cell.split_once('.').map(|(_, rest)| rest.chars().count());
            let is_number = |cell: &str| cell.starts_with(['−', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']);
            let most = rows.iter().filter_map(|row| row.get(index)).filter_map(|cell| decimals(cell)).max();
            let Some(most) = most else { continue };
            for cell in rows.iter_mut().filter_map(|row| row.get_mut(index)).filter(|cell| is_number(cell)) {
                let own = decimals(cell);
                if own.is_none() {
                    cell.push(POINT_SPACE);
                }
                cell.extend(std::iter::repeat_n(FIGURE_SPACE, most - own.unwrap_or(0)));
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_points_stand_below_each_other() {
        let table = Table {
            caption: String::new(),
            columns: vec![Column::numbers("x")],
            rows: ["−247", "0.304", "12.5", "–"].map(|cell| vec![cell.to_owned()]).to_vec(),
        };
        let cells: Vec<String> = table.aligned().into_iter().flatten().collect();
        let behind_point = |cell: &str| cell.chars().rev().position(|letter| matches!(letter, '.' | POINT_SPACE));
        assert_eq!(cells[..3].iter().map(|cell| behind_point(cell)).collect::<Vec<_>>(), [Some(3); 3]);
        assert_eq!(cells[3], "–");
    }
}
