//! Makes the card of a set of sources: properties of their labels, and the agreement of each two sources.

use super::rows::RefusedShape;
use super::statistic::{Statistic, statistic};
use super::tables::CAP;
use super::text::refused_lines;
use crate::bootstrap::Bootstrap;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;

/// The labels of one source on one shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CardRow {
    /// The id of the shape.
    pub shape: String,
    /// The group of related shapes that the bootstrap draws together.
    pub group: String,
    /// The source.
    pub source: String,
    /// The number of labels of the triangles.
    pub n_labels: u32,
    /// See [`super::size_entropy`].
    pub size_entropy: f64,
    /// The length of all borders between labels, divided by the diagonal of the bounding box.
    pub border_length: f64,
}

/// Two sources on one shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairRow {
    /// The id of the shape.
    pub shape: String,
    /// The group of related shapes that the bootstrap draws together.
    pub group: String,
    /// The two sources.
    pub sources: [String; 2],
    /// The adjusted Rand index of their labels over points of the surface.
    pub ari: f64,
}

/// The card of a set of sources.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CardTables {
    /// One entry per source that has labeled a shape.
    pub sources: Vec<SourceCard>,
    /// One entry per pair of sources that have labeled the same shape.
    pub pairs: Vec<PairCard>,
    /// The shapes on which two sources differ most, beginning with the largest difference. Each shape is listed once.
    pub most_different: Vec<PairRow>,
    /// The shapes that a source refused.
    pub refused: Vec<RefusedShape>,
}

/// One source over all shapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceCard {
    /// The source.
    pub source: String,
    /// Shapes that it labeled.
    pub n_shapes: usize,
    /// Labels per shape.
    pub n_labels: Statistic,
    /// The smallest, the middle and the largest number of labels.
    pub label_range: [u32; 3],
    /// The fraction of the shapes with only one label. Nothing can be learned from them.
    pub fraction_single: f64,
    /// The fraction of the shapes with at least 20 labels: the cap of the paper's exporter.
    pub fraction_at_cap: f64,
    /// The entropy of the areas, in nats.
    pub size_entropy: Statistic,
    /// The length of the borders, in diagonals.
    pub border_length: Statistic,
}

/// Two sources over all shapes that both label.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairCard {
    /// The two sources.
    pub sources: [String; 2],
    /// The adjusted Rand index.
    pub ari: Statistic,
}

/// Makes the card. `sources` gives the order of the entries. `n_most` is the number of most different shapes that are kept.
///
/// The order of the rows does not matter.
#[must_use]
pub fn card_tables(
    mut rows: Vec<CardRow>,
    mut pairs: Vec<PairRow>,
    mut refused: Vec<RefusedShape>,
    sources: &[String],
    n_most: usize,
    bootstrap: Bootstrap,
) -> CardTables {
    rows.sort_by(|a, b| a.shape.cmp(&b.shape));
    pairs.sort_by(|a, b| a.shape.cmp(&b.shape));
    refused.sort();
    let card = |source: &String| {
        let of_source: Vec<&CardRow> = rows.iter().filter(|row| row.source == *source).collect();
        source_card(&of_source, bootstrap)
    };
    let mut pair_cards = Vec::new();
    for (idx, first) in sources.iter().enumerate() {
        for second in &sources[idx + 1..] {
            let is_of_pair =
                |pair: &&PairRow| pair.sources[0] == *first && pair.sources[1] == *second;
            let values = pairs
                .iter()
                .filter(is_of_pair)
                .map(|pair| (pair.group.as_str(), pair.ari));
            let names = [first.clone(), second.clone()];
            pair_cards.extend(statistic(values, bootstrap).map(|ari| PairCard {
                sources: names,
                ari,
            }));
        }
    }
    CardTables {
        sources: sources.iter().filter_map(card).collect(),
        pairs: pair_cards,
        most_different: most_different(&pairs, n_most),
        refused,
    }
}

fn source_card(rows: &[&CardRow], bootstrap: Bootstrap) -> Option<SourceCard> {
    let over = |of: fn(&CardRow) -> f64| {
        statistic(
            rows.iter().map(|row| (row.group.as_str(), of(row))),
            bootstrap,
        )
    };
    let fraction = |is_counted: fn(&CardRow) -> bool| {
        rows.iter().filter(|row| is_counted(row)).count() as f64 / rows.len() as f64
    };
    let mut counts: Vec<u32> = rows.iter().map(|row| row.n_labels).collect();
    counts.sort_unstable();
    Some(SourceCard {
        source: rows.first()?.source.clone(),
        n_shapes: rows.len(),
        n_labels: over(|row| f64::from(row.n_labels))?,
        label_range: [
            counts[0],
            counts[counts.len() / 2],
            counts[counts.len() - 1],
        ],
        fraction_single: fraction(|row| row.n_labels <= 1),
        fraction_at_cap: fraction(|row| row.n_labels as usize >= CAP),
        size_entropy: over(|row| row.size_entropy)?,
        border_length: over(|row| row.border_length)?,
    })
}

/// The most different pair of sources of each shape, sorted by difference. In a tie, the lower id comes first.
fn most_different(pairs: &[PairRow], n_most: usize) -> Vec<PairRow> {
    let mut ranked: Vec<&PairRow> = pairs.iter().collect();
    ranked.sort_by(|a, b| a.ari.total_cmp(&b.ari).then_with(|| a.shape.cmp(&b.shape)));
    let mut chosen: Vec<PairRow> = Vec::new();
    for pair in ranked {
        let is_new = chosen.iter().all(|other| other.shape != pair.shape);
        if is_new && chosen.len() < n_most {
            chosen.push(pair.clone());
        }
    }
    chosen
}

impl CardTables {
    /// The card in Markdown: a row per source, the matrix of the indices, and the most different shapes.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let mut text = String::from(
            "| source | shapes | labels | smallest, median, largest | one label only | 20 labels or more | size entropy | \
             border length / diagonal |\n|---|---:|---:|---:|---:|---:|---:|---:|\n",
        );
        for card in &self.sources {
            let [low, median, high] = card.label_range;
            let _ = writeln!(
                text,
                "| `{}` | {} | {} | {low}, {median}, {high} | {:.0} % | {:.0} % | {} | {} |",
                card.source,
                card.n_shapes,
                with_deviation(&card.n_labels, 1),
                100.0 * card.fraction_single,
                100.0 * card.fraction_at_cap,
                with_deviation(&card.size_entropy, 2),
                with_deviation(&card.border_length, 1),
            );
        }
        self.push_matrix(&mut text);
        self.push_most_different(&mut text);
        text + &refused_lines(&self.refused)
    }

    fn push_matrix(&self, text: &mut String) {
        if self.pairs.is_empty() {
            return;
        }
        let names: Vec<&str> = self
            .sources
            .iter()
            .map(|card| card.source.as_str())
            .collect();
        let headings: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        let _ = writeln!(
            text,
            "\nMean ARI of each two sources:\n\n| | {} |",
            headings.join(" | ")
        );
        let _ = writeln!(text, "|---|{}", "---:|".repeat(names.len()));
        for row in &names {
            let cells: Vec<String> = names.iter().map(|column| self.cell(row, column)).collect();
            let _ = writeln!(text, "| `{row}` | {} |", cells.join(" | "));
        }
    }

    fn cell(&self, row: &str, column: &str) -> String {
        let joins = |pair: &&PairCard| {
            let [a, b] = &pair.sources;
            (a == row && b == column) || (a == column && b == row)
        };
        match self.pairs.iter().find(joins) {
            Some(pair) => format!("{:.3}", pair.ari.mean),
            None => String::new(),
        }
    }

    fn push_most_different(&self, text: &mut String) {
        if self.most_different.is_empty() {
            return;
        }
        let _ = writeln!(
            text,
            "\nThe shapes on which two sources differ most:\n\n| shape | sources | ARI |"
        );
        let _ = writeln!(text, "|---|---|---:|");
        for pair in &self.most_different {
            let [a, b] = &pair.sources;
            let _ = writeln!(text, "| {} | `{a}`, `{b}` | {:.3} |", pair.shape, pair.ari);
        }
    }

    /// Everything, in full precision.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Text, numbers and lists always serialize. The fallback only avoids a panic.
        serde_json::to_string_pretty(self)
            .map(|json| json + "\n")
            .unwrap_or_default()
    }
}

fn with_deviation(statistic: &Statistic, decimals: usize) -> String {
    match statistic.deviation {
        Some(deviation) => format!("{:.decimals$} ± {deviation:.decimals$}", statistic.mean),
        None => format!("{:.decimals$}", statistic.mean),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(shape: &str, source: &str, n_labels: u32) -> CardRow {
        CardRow {
            shape: shape.to_owned(),
            group: shape.to_owned(),
            source: source.to_owned(),
            n_labels,
            size_entropy: 1.0,
            border_length: 2.0,
        }
    }

    fn pair(shape: &str, sources: [&str; 2], ari: f64) -> PairRow {
        PairRow {
            shape: shape.to_owned(),
            group: shape.to_owned(),
            sources: sources.map(str::to_owned),
            ari,
        }
    }

    #[test]
    fn a_card_counts_labels_and_ranks_differences() {
        let sources = ["x", "y", "z"].map(str::to_owned);
        let rows = vec![
            row("b", "x", 20),
            row("a", "x", 1),
            row("a", "y", 5),
            row("b", "y", 7),
        ];
        let pairs = vec![
            pair("b", ["x", "y"], 0.5),
            pair("a", ["x", "y"], 0.25),
            pair("a", ["x", "z"], 0.1),
            pair("a", ["y", "z"], 0.3),
        ];
        let bootstrap = Bootstrap {
            draws: 10,
            seed: 0,
            least_groups: 2,
        };
        let card = card_tables(rows, pairs, Vec::new(), &sources, 5, bootstrap);
        assert_eq!(card.sources.len(), 2);
        let of_x = &card.sources[0];
        assert_eq!(
            (of_x.label_range, of_x.fraction_single, of_x.fraction_at_cap),
            ([1, 20, 20], 0.5, 0.5)
        );
        assert_eq!((card.pairs.len(), card.pairs[0].ari.mean), (3, 0.375));
        let most: Vec<(&str, f64)> = card
            .most_different
            .iter()
            .map(|pair| (pair.shape.as_str(), pair.ari))
            .collect();
        assert_eq!(most, [("a", 0.1), ("b", 0.5)]);
        let text = card.to_markdown();
        assert!(
            text.contains("| `x` |  | 0.375 |") && text.contains("| a | `x`, `z` | 0.100 |"),
            "{text}"
        );
    }
}
