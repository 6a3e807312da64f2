//! Writes TensorBoard's event files: named numbers of a step go in, and bytes to append come out.
//!
//! A file is a sequence of TFRecords (length, checksum of the length, data, checksum of the data). Each one contains an `Event`
//! of TensorFlow's `event.proto` in protobuf's wire format. Only scalars are written, and nothing is read back.

/// The content of a record of an event file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TensorboardEvent<'a> {
    /// The first record of a file.
    FileVersion,
    /// A program starts to write at this step. Values of later steps in other files no longer count.
    Start {
        /// The next step.
        step: u64,
    },
    /// Numbers of a step, by their tags.
    Scalars {
        /// The step.
        step: u64,
        /// Tags and values.
        values: &'a [(&'a str, f32)],
    },
}

/// The bytes of one record. `seconds` is its time since 1970.
#[must_use]
pub fn tensorboard_record(seconds: f64, event: &TensorboardEvent) -> Vec<u8> {
    let data = event_message(seconds, event);
    let length = (data.len() as u64).to_le_bytes();
    let mut record = Vec::with_capacity(data.len() + 16);
    record.extend(length);
    record.extend(masked_crc(&length).to_le_bytes());
    record.extend(&data);
    record.extend(masked_crc(&data).to_le_bytes());
    record
}

/// `Event { wall_time = 1, step = 2, file_version = 3, summary = 5, session_log = 7 }`.
fn event_message(seconds: f64, event: &TensorboardEvent) -> Vec<u8> {
    let mut message = vec![key(1, Wire::Fixed64)];
    message.extend(seconds.to_le_bytes());
    match event {
        TensorboardEvent::FileVersion => put_bytes(&mut message, 3, b"brain.Event:2"),
        TensorboardEvent::Start { step } => {
            put_integer(&mut message, 2, *step);
            // SessionLog { status = 1: START = 1 }
            put_bytes(&mut message, 7, &[key(1, Wire::Varint), 1]);
        }
        TensorboardEvent::Scalars { step, values } => {
            put_integer(&mut message, 2, *step);
            let mut summary = Vec::new();
            values
                .iter()
                .for_each(|(tag, value)| put_bytes(&mut summary, 1, &scalar_message(tag, *value)));
            put_bytes(&mut message, 5, &summary);
        }
    }
    message
}

/// `Summary.Value { tag = 1, simple_value = 2 }`.
fn scalar_message(tag: &str, value: f32) -> Vec<u8> {
    let mut message = Vec::new();
    put_bytes(&mut message, 1, tag.as_bytes());
    message.push(key(2, Wire::Fixed32));
    message.extend(value.to_le_bytes());
    message
}

/// Protobuf's wire types.
#[derive(Clone, Copy)]
enum Wire {
    Varint = 0,
    Fixed64 = 1,
    Bytes = 2,
    Fixed32 = 5,
}

fn key(field: u8, wire: Wire) -> u8 {
    field << 3 | wire as u8
}

fn put_integer(message: &mut Vec<u8>, field: u8, value: u64) {
    message.push(key(field, Wire::Varint));
    put_varint(message, value);
}

fn put_bytes(message: &mut Vec<u8>, field: u8, bytes: &[u8]) {
    message.push(key(field, Wire::Bytes));
    put_varint(message, bytes.len() as u64);
    message.extend(bytes);
}

/// Appends a number with seven bits per byte, the lowest first. The highest bit of a byte says that more bytes follow.
fn put_varint(message: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        message.push(value as u8 | 0x80);
        value >>= 7;
    }
    message.push(value as u8);
}

/// The checksum of TFRecords: CRC-32C, rotated and with a constant added, so that checksums of data with checksums are still
/// good.
fn masked_crc(bytes: &[u8]) -> u32 {
    crc32c(bytes).rotate_right(15).wrapping_add(0xa282_ead8)
}

/// CRC-32 with Castagnoli's polynomial (RFC 3720, appendix B.4), bit by bit. This is fast enough, because a step writes a few
/// hundred bytes.
fn crc32c(bytes: &[u8]) -> u32 {
    const REVERSED_POLYNOMIAL: u32 = 0x82f6_3b78;
    let feed = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            if crc & 1 == 1 {
                crc >> 1 ^ REVERSED_POLYNOMIAL
            } else {
                crc >> 1
            }
        })
    };
    !bytes.iter().fold(u32::MAX, feed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // RFC 3720, B.4: 32 zeros, 32 ones, 0..32; and the check value that catalogues of checksums give.
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
        assert_eq!(crc32c(&[0xff; 32]), 0x62a8_ab43);
        assert_eq!(crc32c(&(0..32).collect::<Vec<u8>>()), 0x46dd_794e);
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
    }

    /// The data of each record. Both checksums are checked.
    fn records(mut bytes: &[u8]) -> Vec<&[u8]> {
        let mut found = Vec::new();
        while let Some((length, rest)) = bytes.split_first_chunk::<8>() {
            let (length_crc, rest) = rest.split_first_chunk::<4>().unwrap();
            assert_eq!(u32::from_le_bytes(*length_crc), masked_crc(length));
            let (data, rest) = rest.split_at(u64::from_le_bytes(*length) as usize);
            let (data_crc, rest) = rest.split_first_chunk::<4>().unwrap();
            assert_eq!(u32::from_le_bytes(*data_crc), masked_crc(data));
            found.push(data);
            bytes = rest;
        }
        found
    }

    #[test]
    fn records_follow_each_other_and_hold_their_events() {
        let values = [("train/loss", 0.5f32), ("valid/miou", -1.0)];
        let events = [
            TensorboardEvent::FileVersion,
            TensorboardEvent::Start { step: 300 },
            TensorboardEvent::Scalars {
                step: 1,
                values: &values,
            },
        ];
        let bytes: Vec<u8> = events
            .iter()
            .flat_map(|event| tensorboard_record(2.0, event))
            .collect();
        let found = records(&bytes);
        // 0x09: field 1 as a double; 2.0 is 0x4000000000000000.
        let time = [0x09, 0, 0, 0, 0, 0, 0, 0, 0x40];
        assert_eq!(
            found[0],
            [&time[..], &[0x1a, 13], b"brain.Event:2"].concat()
        );
        // 300 is 0b10_0101100: a varint of two bytes.
        assert_eq!(
            found[1],
            [&time[..], &[0x10, 0xac, 0x02, 0x3a, 2, 0x08, 1]].concat()
        );
        let scalar = |tag: &str, value: f32| {
            let head = [0x0a, tag.len() as u8 + 7, 0x0a, tag.len() as u8];
            [&head[..], tag.as_bytes(), &[0x15], &value.to_le_bytes()].concat()
        };
        let summary = [scalar("train/loss", 0.5), scalar("valid/miou", -1.0)].concat();
        assert_eq!(
            found[2],
            [&time[..], &[0x10, 1, 0x2a, summary.len() as u8], &summary].concat()
        );
        assert_eq!(found.len(), 3);
    }
}
