//! Figures, tables, pages.
