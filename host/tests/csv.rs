//! What the recorder's CSV promises: exact numbers, and clear words about bad files.

use std::path::Path;

use barrel::csv::{self, BRAIN_COLUMNS, CsvError, Table, Writer};
use hil_sim::record::{BrainRecord, PlantRecord};
use proptest::prelude::*;

fn brain(t: f64) -> BrainRecord<f32> {
    BrainRecord { t, x: [0.1, -0.25], y: [1.0, -1e-20], error: f32::MIN_POSITIVE, ..BrainRecord::default() }
}

fn written(plant: Option<&PlantRecord>, rows: &[BrainRecord<f32>]) -> String {
    let mut writer = Writer::new(Vec::new(), plant.is_some());
    for row in rows {
        writer.write(row, plant).unwrap();
    }
    String::from_utf8(writer.finish().unwrap()).unwrap()
}

fn parse(text: &str) -> Result<Table, CsvError> {
    csv::parse(Path::new("my.csv"), text.as_bytes())
}

fn complaint(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn header_and_numbers_have_the_promised_form() {
    let text = written(None, &[brain(3.0 * 0.02)]);
    assert_eq!(
        text,
        "t,x1,x2,y1,y2,C11,C12,C21,C22,h1,h2,A11,A12,A21,A22,b1,b2,xi1,xi2,E,E_tle\n\
         0.06,0.1,-0.25,1,-1e-20,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1.1754944e-38,0\n"
    );
    let plant =
        PlantRecord { omega: 0.1 + 0.2, phi: -0.0, position: [1e16, 1e-7, 123456.75], ..PlantRecord::default() };
    let text = written(Some(&plant), &[brain(0.0)]);
    assert!(text.lines().next().unwrap().ends_with(",E,E_tle,omega,phi,s1,s2,px,py,pz,tilt"), "{text}");
    assert!(text.ends_with(",0.30000000000000004,-0,0,0,1e16,1e-7,123456.75,0\n"), "{text}");
}

#[test]
fn time_is_the_shortest_decimal_of_its_control_step() {
    let mut t = 0.0;
    for k in 0..100_000_u32 {
        let expected = format!("{}.{:02}", k / 50, k % 50 * 2);
        let expected = expected.trim_end_matches('0').trim_end_matches('.');
        // However the clock counts: by product or by sum.
        for t in [0.02 * f64::from(k), t] {
            assert_eq!(csv::shortest(csv::grid_time(t)), expected);
        }
        t += 0.02;
    }
}

#[test]
fn both_formats_lay_out_their_digits_alike() {
    for text in
        ["0.0001", "1e-5", "-1.25e-5", "1.5e-6", "1e-7", "1234567", "1e12", "1e13", "1.5e14", "1e16", "1e-20", "-0"]
    {
        let text = text.replace("1e12", "1000000000000");
        assert_eq!(csv::shortest(text.parse::<f32>().unwrap()), text, "f32");
        assert_eq!(csv::shortest(text.parse::<f64>().unwrap()), text, "f64");
    }
}

proptest! {
    #[test]
    fn every_number_reads_back_exactly(single in any::<u32>(), double in any::<u64>()) {
        let (single, double) = (f32::from_bits(single), f64::from_bits(double));
        prop_assume!(single.is_finite() && double.is_finite());
        prop_assert_eq!(csv::shortest(single).parse::<f32>().unwrap().to_bits(), single.to_bits());
        prop_assert_eq!(csv::shortest(double).parse::<f64>().unwrap().to_bits(), double.to_bits());
        prop_assert!(csv::shortest(single).len() <= 16 && csv::shortest(double).len() <= 25);
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200), header in any::<bool>()) {
        let bytes = if header { [b"t,x1,x2\n", &bytes[..]].concat() } else { bytes };
        let _ = csv::parse(Path::new("my.csv"), &bytes);
    }
}

#[test]
fn a_recording_is_reproduced_bit_for_bit_or_the_first_difference_is_named() {
    let rows: Vec<BrainRecord<f32>> =
        (0..50_u8).map(|k| BrainRecord { xi: [0.1 / f32::from(k + 1), -0.0], ..brain(0.02 * f64::from(k)) }).collect();
    let table = parse(&written(None, &rows)).unwrap();
    assert_eq!(table.rows(), 50);
    assert_eq!(table.sensors().unwrap()[7][0] as f32, 0.1_f32);
    for (k, row) in rows.iter().enumerate() {
        assert_eq!(table.difference(k, row), None);
    }
    let mut other = rows[3];
    other.xi[0] = other.xi[0].next_up();
    assert_eq!(table.difference(3, &other).unwrap().column, "xi1");
    other = BrainRecord { xi: [rows[3].xi[0], 0.0], ..rows[3] };
    assert_eq!(table.difference(3, &other).unwrap().column, "xi2", "a lost sign of zero is a difference too");
}

#[test]
fn any_csv_with_sensors_is_a_recording() {
    let table = parse("\u{feff}note, \"x2\" ,x1\r\nfell over,2,1\r\nand up,4,3").unwrap();
    assert_eq!(table.sensors().unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
    assert_eq!(table.time(), [0.0, 0.02]);
    assert_eq!(table.names(), ["x2", "x1"], "a column of words is left out");
}

#[test]
fn bad_files_are_told_apart_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.csv");
    let error = csv::read(&missing).unwrap_err();
    assert!(matches!(error, CsvError::Read { .. }) && error.to_string().contains("missing.csv"), "{error}");
    assert!(matches!(csv::read(folder.path()), Err(CsvError::Read { .. })), "a folder is not a CSV");

    for (text, says) in [
        ("", "my.csv is empty"),
        ("\n \n", "my.csv is empty"),
        ("0,1,2\n3,4,5\n", "no header: its first line is '0,1,2'"),
        ("t,x1,x2\n", "no rows"),
        ("t,x1,x1\n0,1,2\n", "column 'x1' occurs twice"),
        ("t,x1,x2\n0,1,2\n0.02,3\n0.04,5,6\n", "line 3: 2 fields, but the header has 3"),
        ("t,x1,x2\n0,1,2,9\n", "line 2: 4 fields, but the header has 3"),
        ("t,x1,x2\n0,1,two\n", "line 2, column x2: 'two' is not a number"),
        ("t,x1,x2\n0,,2\n", "line 2, column x1: '' is not a number"),
        ("t,x1,x2\n0,1,2\n0.02,NaN,2\n", "line 3, column x1: 'NaN' is not finite"),
        ("t,x1,x2\n0,1,-inf\n", "line 2, column x2: '-inf' is not finite"),
        ("t,x1,x2\n0,1,1e999\n", "line 2, column x2: '1e999' is not finite"),
        (
            "t,x1,x2\n0,1,2\n0.02,3",
            "line 3: the last line is cut off ('0.02,3'); delete it to use the 1 rows before it",
        ),
        ("t,x1,x2\n0,1,2\n0.02,3,-", "line 3: the last line is cut off"),
    ] {
        assert!(complaint(text).contains(says), "{text:?}: {}", complaint(text));
    }
    let binary = csv::parse(Path::new("my.csv"), b"\x89MCAP0\r\n\xff").unwrap_err().to_string();
    assert!(binary.contains("not a CSV: byte 0") && binary.contains(".mcap"), "{binary}");
}

#[test]
fn a_missing_column_leads_to_the_nearest_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.csv");
    std::fs::write(&path, "t,x1,X2\n0,1,2\n").unwrap();
    let error = csv::read_recording(&path).unwrap_err().to_string();
    assert!(error.contains("has no column 'x2': did you mean 'X2'?"), "{error}");

    let error = parse(&written(None, &[brain(0.0)])).unwrap().column("c11").unwrap_err().to_string();
    assert!(error.ends_with("no column 'c11': did you mean 'C11'?"), "{error}");
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no/such/folder/run.csv");
    let error = Writer::create(&path, false).err().unwrap().to_string();
    assert!(error.contains("no/such/folder/run.csv") && error.contains("choose a folder"), "{error}");
}

#[test]
fn a_whole_written_file_reads_back_column_by_column() {
    let plant = PlantRecord { omega: -1.5, tilt: 0.1, ..PlantRecord::default() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let mut writer = Writer::create(&path, true).unwrap();
    for k in 0..5000 {
        writer.write(&brain(f64::from(k) * 0.02), Some(&plant)).unwrap();
    }
    writer.finish().unwrap();
    let table = csv::read_recording(&path).unwrap();
    assert_eq!((table.rows(), table.names().len()), (5000, BRAIN_COLUMNS.len() + 8));
    assert_eq!(table.column("t").unwrap()[4999], 99.98);
    assert_eq!(table.column("tilt").unwrap()[17], 0.1);
}
