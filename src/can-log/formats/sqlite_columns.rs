//! The columns of an SQLite table, from the `CREATE TABLE` statement in the schema.

/// Returns the column names of a `CREATE TABLE` statement, in the order of the values.
pub(super) fn column_names(sql: &str) -> Vec<String> {
    let (mut names, mut depth, mut is_start) = (Vec::new(), 0_usize, false);
    let mut rest = sql;
    while let Some(char) = rest.chars().next() {
        let quote = match char {
            '"' | '`' | '\'' => Some(char),
            '[' => Some(']'),
            _ => None,
        };
        let inner = &rest[char.len_utf8()..];
        let length = match quote {
            Some(end) => inner.find(end).unwrap_or(inner.len()),
            None => rest.find(|char: char| !char.is_alphanumeric() && char != '_').unwrap_or(rest.len()),
        };
        let word = if quote.is_some() { &inner[..length] } else { &rest[..length] };
        match char {
            '(' => {
                is_start = depth == 0;
                depth += 1;
            }
            ')' => depth = depth.saturating_sub(1),
            ',' => is_start = depth == 1,
            _ if is_start && !char.is_whitespace() => {
                names.push(word.to_owned());
                is_start = false;
            }
            _ => {}
        }
        let end = if quote.is_some() { char.len_utf8() + length + 1 } else { length.max(char.len_utf8()) };
        rest = rest.get(end..).unwrap_or_default();
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_known_by_the_statement_that_made_the_table() {
        for (sql, expected) in [
            (
                "CREATE TABLE t(a, b INTEGER DEFAULT (1, 2), \"c d\" TEXT,[e], `f` REAL, PRIMARY KEY (a, b))",
                "a|b|c d|e|f|PRIMARY",
            ),
            ("create table 'x(' (\n  ü_1 DECIMAL(10,2),\r\n\tb\n)", "ü_1|b"),
            ("CREATE TABLE \"t", ""),
        ] {
            assert_eq!(column_names(sql).join("|"), expected, "{sql}");
        }
    }
}
