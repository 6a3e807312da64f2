//! Lists the columns of a table: `cargo run --release -p partprobe-tables --example list_columns -- tables/part-00000.parquet`

use partprobe_tables::{Columns, table_from_parquet};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give a file of an export, for example tables/part-00000.parquet")?;
    let file = table_from_parquet(std::fs::read(path)?, Columns::All)?;
    for (key, value) in &file.metadata {
        println!("{key} = {value}");
    }
    for column in file.table.columns() {
        println!("{}: {} rows", column.name(), column.n_rows());
    }
    Ok(())
}
