//! Tests that tables are the same after writing and reading Parquet, also with missing values, and that damaged files are
//! refused.

use crate::{
    Column, Columns, ListCell, ParquetReadError, ShapeLabels, ShapeOrigin, ShapeRow, Table, Text,
    labels_of_table, layers_of, shape_metadata, shape_table, table_from_parquet, table_to_parquet,
};
use partprobe_carrier::{Carrier, LabelLayer};
use proptest::collection::vec;
use proptest::option::of;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

fn read(bytes: Vec<u8>) -> Table {
    table_from_parquet(bytes, Columns::All).unwrap().table
}

prop_compose! {
    fn tables()(n in 0_usize..20)(
        ints in vec(of(any::<i32>()), n),
        ids in vec(of(any::<u64>()), n),
        numbers in vec(of(-1e300..1e300_f64), n),
        texts in vec(of(".{0,5}"), n),
        int_lists in vec(of(vec(of(any::<i32>()), 0..6)), n),
        text_lists in vec(of(vec(of(".{0,3}"), 0..4)), n),
    ) -> Table {
        let owned = |text: Option<String>| text.map(Text::Owned);
        let text_lists = text_lists
            .into_iter()
            .map(|list: Option<Vec<_>>| list.map(|list| list.into_iter().map(owned).collect()));
        Table::new(vec![
            Column::of_cells("ints", ints),
            Column::of_cells("ids", ids),
            Column::of_cells("numbers", numbers),
            Column::of_cells("texts", texts.into_iter().map(owned)),
            Column::of_lists("int lists", int_lists),
            Column::of_lists::<Text>("text lists", text_lists),
        ])
        .unwrap()
    }
}

proptest! {
    #[test]
    fn a_table_round_trips(table in tables()) {
        let bytes = table_to_parquet(&table, &BTreeMap::new()).unwrap();
        prop_assert_eq!(&bytes, &table_to_parquet(&table, &BTreeMap::new()).unwrap());
        prop_assert_eq!(read(bytes), table);
    }

    #[test]
    fn damaged_bytes_give_an_error_or_a_table(
        table in tables(), position in any::<prop::sample::Index>(), byte in any::<u8>(),
    ) {
        let mut bytes = table_to_parquet(&table, &BTreeMap::new()).unwrap();
        let position = position.index(bytes.len());
        let cut = table_from_parquet(bytes[..position].to_vec(), Columns::All);
        prop_assert!(matches!(cut, Err(ParquetReadError::Damaged(_))));
        bytes[position] = byte;
        // A changed byte may be one that is not read. The only requirement is that there is no panic.
        let _ = table_from_parquet(bytes, Columns::All);
    }
}

#[test]
fn lists_longer_than_a_page_round_trip() {
    let lists: Vec<ListCell<f64>> = (0..9000)
        .map(|row| {
            Some(
                (0..row % 50)
                    .map(|item| Some(f64::from(item * row)))
                    .collect(),
            )
        })
        .collect();
    let table = Table::new(vec![Column::of_lists("numbers", lists)]).unwrap();
    let bytes = table_to_parquet(&table, &BTreeMap::new()).unwrap();
    assert_eq!(read(bytes), table);
}

#[test]
fn columns_are_chosen_by_name() {
    let column = |name: &str| Column::of_cells(name, [Some(1)]);
    let table = Table::new(vec![column("a"), column("b"), column("c")]).unwrap();
    let bytes = table_to_parquet(&table, &shape_metadata()).unwrap();
    let chosen = table_from_parquet(bytes.clone(), Columns::Named(&["c", "a"])).unwrap();
    assert_eq!(chosen.metadata, shape_metadata());
    assert_eq!(
        chosen.table,
        Table::new(vec![column("c"), column("a")]).unwrap()
    );
    let missing = table_from_parquet(bytes, Columns::Named(&["d"]));
    assert_eq!(
        missing,
        Err(ParquetReadError::MissingColumn("d".to_owned()))
    );
}

fn block() -> Carrier {
    let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
    let file = partprobe_label::label(
        text.as_bytes(),
        "block",
        &partprobe_label::LabelOptions::default(),
    );
    file.unwrap().shapes.remove(0).carrier.unwrap()
}

#[test]
fn labels_are_read_from_the_table_of_shapes() {
    let with_layer = block()
        .with_layer("smooth-12", LabelLayer::from(vec![0, 1, 2, 3, 4, 5]))
        .unwrap();
    let carriers = [with_layer, block()];
    let layers: BTreeSet<String> = carriers.iter().flat_map(layers_of).collect();
    let row = |carrier: &Carrier| ShapeRow::new(ShapeOrigin::default(), carrier);
    let rows: Vec<ShapeRow> = carriers.iter().map(row).collect();
    let table = shape_table(&rows, &layers).unwrap();
    let bytes = table_to_parquet(&table, &shape_metadata()).unwrap();

    let expected: Vec<Option<ShapeLabels>> = carriers
        .iter()
        .map(|carrier| Some(ShapeLabels::of(carrier)))
        .collect();
    assert_eq!(labels_of_table(read(bytes)).unwrap(), expected);
    assert_eq!(expected[0].as_ref().unwrap().layers.len(), 1);
    assert_eq!(expected[1].as_ref().unwrap().edge_faces.len(), 12);
}
