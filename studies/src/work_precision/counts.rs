//! Counts from emulated processors, measured by other programs: lines of `name,number[,number…]`.

/// The lines of a table, without comments (`#`) and lines without a number.
pub fn rows(table: &str) -> impl Iterator<Item = (&str, Vec<f64>)> {
    let lines = table.lines().filter(|line| !line.starts_with('#'));
    lines.filter_map(|line| {
        let (name, numbers) = line.split_once(',')?;
        let numbers: Vec<f64> = numbers.split(',').map_while(|number| number.trim().parse().ok()).collect();
        (!numbers.is_empty()).then_some((name.trim(), numbers))
    })
}

/// Names and their first numbers.
pub fn of(table: &str) -> Vec<(String, f64)> {
    rows(table).map(|(name, numbers)| (name.to_string(), numbers[0])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_heads_and_empty_lines_are_no_counts() {
        let table = "# what it is\nname,count\n\nk-means, 120000\nml,5e6,7\n";
        assert_eq!(of(table), [("k-means".to_string(), 120_000.0), ("ml".to_string(), 5e6)]);
        assert_eq!(rows(table).last(), Some(("ml", vec![5e6, 7.0])));
    }
}
