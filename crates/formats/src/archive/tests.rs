use super::*;
use proptest::prelude::*;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

const KINDS: [ArchiveKind; 6] = [
    ArchiveKind::Zip,
    ArchiveKind::Tar,
    ArchiveKind::TarGz,
    ArchiveKind::TarZst,
    ArchiveKind::TarXz,
    ArchiveKind::SevenZip,
];
/// The largest size of members.
const LIMIT: u64 = 2_000;

fn packed(kind: ArchiveKind, members: &[(&str, &[u8])]) -> Vec<u8> {
    match kind {
        ArchiveKind::Zip => zipped(members),
        ArchiveKind::Tar => tarred(members),
        ArchiveKind::TarGz => gzipped(&tarred(members)),
        ArchiveKind::TarXz => xzipped(&tarred(members)),
        ArchiveKind::TarZst => zstd::encode_all(tarred(members).as_slice(), 1).unwrap(),
        ArchiveKind::SevenZip => seven_zipped(members),
    }
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gz.write_all(bytes).unwrap();
    gz.finish().unwrap()
}

fn xzipped(bytes: &[u8]) -> Vec<u8> {
    let mut xz =
        lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::with_preset(0)).unwrap();
    xz.write_all(bytes).unwrap();
    xz.finish().unwrap()
}

fn zipped(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn tarred(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut tar = tar::Builder::new(Vec::new());
    for (name, bytes) in members {
        // The builder refuses hostile names, so the name is written into the header by hand.
        let mut header = tar::Header::new_gnu();
        header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_size(bytes.len() as u64);
        header.set_cksum();
        tar.append(&header, *bytes).unwrap();
    }
    tar.into_inner().unwrap()
}

/// One solid block.
fn seven_zipped(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = sevenz_rust2::ArchiveWriter::new(Cursor::new(Vec::new())).unwrap();
    let entries = members
        .iter()
        .map(|(name, _)| sevenz_rust2::ArchiveEntry::new_file(name))
        .collect();
    let readers = members
        .iter()
        .map(|(_, bytes)| sevenz_rust2::SourceReader::new(*bytes))
        .collect();
    writer.push_archive_entries(entries, readers).unwrap();
    writer.finish().unwrap().into_inner()
}

/// One line per member, and one for the damage.
fn walked(kind: ArchiveKind, bytes: &[u8]) -> Vec<String> {
    let mut lines = Vec::new();
    let ended = walk_archive(kind, Cursor::new(bytes), &mut |member| {
        let what = match member.content {
            Ok((name, content)) => match content.read(LIMIT) {
                Ok(bytes) => format!(
                    "{} = {}",
                    name.components().join("/"),
                    String::from_utf8_lossy(&bytes)
                ),
                Err(error) => format!("{} ! {error}", member.given_name),
            },
            Err(refusal) => format!("{} ! {refusal}", member.given_name),
        };
        lines.push(format!("{} {what}", member.position));
        ControlFlow::Continue(())
    });
    lines.extend(ended.err().map(|damage| damage.to_string()));
    lines
}

#[test]
fn members_of_every_kind_come_in_order_and_hostile_names_are_refused() {
    let large = [b'x'; 3_000];
    let members: [(&str, &[u8]); 5] = [
        ("d/a.step", b"one"),
        ("../b.step", b"two"),
        ("large.step", &large),
        ("in.zip", b"PK"),
        ("./c.step", b"four"),
    ];
    for kind in KINDS {
        let expected = [
            "0 d/a.step = one",
            "1 ../b.step ! the name leads out of the archive; pack the files again with relative names",
            "2 large.step ! the file has more than 2000 bytes",
            "3 in.zip ! it is an archive inside an archive; unpack the outer one first",
            "4 c.step = four",
        ];
        assert_eq!(walked(kind, &packed(kind, &members)), expected, "{kind:?}");
    }
}

#[test]
fn links_in_a_tar_are_refused() {
    let mut tar = tar::Builder::new(Vec::new());
    for (name, kind) in [
        ("sym.step", tar::EntryType::Symlink),
        ("hard.step", tar::EntryType::Link),
    ] {
        let mut header = tar::Header::new_gnu();
        header.set_entry_type(kind);
        header.set_size(0);
        tar.append_link(&mut header, name, "/etc/passwd").unwrap();
    }
    let link = "it is a link; pack the file that it leads to";
    let expected = [
        format!("0 sym.step ! {link}"),
        format!("1 hard.step ! {link}"),
    ];
    assert_eq!(
        walked(ArchiveKind::Tar, &tar.into_inner().unwrap()),
        expected
    );
}

#[test]
fn zip_members_with_one_name_and_encrypted_ones_are_refused() {
    let zip = zipped(&[
        ("a1.step", b"one"),
        ("a2.step", b"two"),
        ("b.step", b"three"),
    ]);
    let text = zip.escape_ascii().to_string().replace("a2.step", "a1.step");
    let repeated = unescaped(&text);
    let duplicate = "0 a1.step ! 2 members have this name, so it is not clear which one is meant";
    assert_eq!(
        walked(ArchiveKind::Zip, &repeated),
        [duplicate, "1 b.step = three"]
    );
    let mut encrypted = zipped(&[("a.step", b"one")]);
    let list = encrypted
        .windows(4)
        .position(|bytes| bytes == b"PK\x01\x02")
        .unwrap();
    (encrypted[6], encrypted[list + 8]) = (1, 1);
    let refused = "0 a.step ! it is encrypted; unpack the archive with its password first";
    assert_eq!(walked(ArchiveKind::Zip, &encrypted), [refused]);
}

/// The bytes that `escape_ascii` has written.
fn unescaped(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        bytes.push(match (first, after) {
            (b'\\', [b'x', high, low, tail @ ..]) => {
                rest = tail;
                u8::from_str_radix(std::str::from_utf8(&[*high, *low]).unwrap(), 16).unwrap()
            }
            (b'\\', [escape, tail @ ..]) => {
                rest = tail;
                match escape {
                    b't' => b'\t',
                    b'r' => b'\r',
                    b'n' => b'\n',
                    other => *other,
                }
            }
            _ => *first,
        });
    }
    bytes
}

#[test]
fn members_before_damage_are_read() {
    // Packers work in blocks of 128 KiB and more, and a block is decoded completely or not at all.
    let mut state = 1u64;
    let mut next_byte = |_| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8 | 1
    };
    let noise: Vec<u8> = (0..400_000).map(&mut next_byte).collect();
    let members: [(&str, &[u8]); 3] =
        [("a.step", b"one"), ("b.step", &noise), ("c.step", b"three")];
    for kind in KINDS {
        let whole = packed(kind, &members);
        let cut = whole.len() * 75 / 100;
        let lines = walked(kind, &whole[..cut]);
        let damage = lines.last().unwrap();
        assert!(
            damage.starts_with("the archive is damaged"),
            "{kind:?}: {lines:?}"
        );
        // The list of a 7z archive is at its end. Without it, no member can be read.
        assert_eq!(
            lines[0] == "0 a.step = one",
            kind != ArchiveKind::SevenZip,
            "{kind:?}: {lines:?}"
        );
    }
    let mut torn = packed(
        ArchiveKind::SevenZip,
        &[members[0], ("b.step", &noise[..1_500]), members[2]],
    );
    torn[600] ^= 0x55;
    let lines = walked(ArchiveKind::SevenZip, &torn);
    assert_eq!(lines[0], "0 a.step = one");
    assert!(
        lines[1].starts_with("1 b.step ! the archive is damaged in this member"),
        "{lines:?}"
    );
    assert_eq!(
        lines[2],
        "2 c.step ! it cannot be reached, since the archive is damaged before it"
    );
    assert!(lines[3].contains("3 members were reached"), "{lines:?}");
}

#[test]
fn an_endless_header_does_not_fill_the_memory() {
    let mut header = tar::Header::new_gnu();
    header.set_entry_type(tar::EntryType::GNULongName);
    header.set_size(1 << 30);
    header.set_cksum();
    let endless = header
        .as_bytes()
        .iter()
        .copied()
        .chain(std::iter::repeat_n(b'a', 4 << 20))
        .collect::<Vec<u8>>();
    let lines = walked(ArchiveKind::Tar, &endless);
    assert!(
        lines[0].contains("the header of a member has no end"),
        "{lines:?}"
    );
}

#[test]
fn a_visitor_may_break_off_and_lists_tell_the_names() {
    for kind in KINDS {
        let bytes = packed(kind, &[("a.step", b"one"), ("b.step", b"two")]);
        let mut n_seen = 0;
        let ended = walk_archive(kind, Cursor::new(&bytes), &mut |_| {
            n_seen += 1;
            ControlFlow::Break(())
        });
        assert_eq!((ended, n_seen), (Ok(()), 1), "{kind:?}");
        let names = listed_names(kind, Cursor::new(&bytes));
        let has_list = matches!(kind, ArchiveKind::Zip | ArchiveKind::SevenZip);
        assert_eq!(
            names,
            has_list.then(|| vec!["a.step".to_owned(), "b.step".to_owned()])
        );
    }
}

/// One file in each container that a STEP file may be packed in.
fn packings(text: &[u8]) -> [Vec<u8>; 4] {
    [
        gzipped(text),
        zstd::encode_all(text, 1).unwrap(),
        xzipped(text),
        zipped(&[("a/b.step", text)]),
    ]
}

#[test]
fn packed_files_give_their_text_and_no_more_than_the_limit() {
    for packed in packings(b"text") {
        assert_eq!(unpacked_step(packed.clone(), LIMIT).unwrap(), b"text");
        assert_eq!(unpacked_step(gzipped(&packed), LIMIT).unwrap(), b"text");
        let deep = (0..5).fold(packed.clone(), |bytes, _| gzipped(&bytes));
        assert_eq!(unpacked_step(deep, LIMIT), Err(UnpackError::TooDeep));
        let cut = unpacked_step(packed[..packed.len() - 6].to_vec(), LIMIT).unwrap_err();
        assert!(matches!(cut, UnpackError::Damaged { .. }), "{cut}");
    }
    for packed in packings(&[b'x'; LIMIT as usize + 1]) {
        assert_eq!(
            unpacked_step(packed, LIMIT),
            Err(UnpackError::TooLarge { limit: LIMIT })
        );
    }
    assert_eq!(unpacked_step(b"text".to_vec(), LIMIT).unwrap(), b"text");
    // Several members of gzip are one text, and padding after them is not damage.
    let several = [gzipped(b"te"), gzipped(b"xt"), vec![0; 100]].concat();
    assert_eq!(unpacked_step(several, LIMIT).unwrap(), b"text");
    let halves = [gzipped(&[b'x'; 1_500]), gzipped(&[b'x'; 1_500])].concat();
    assert_eq!(
        unpacked_step(halves, LIMIT),
        Err(UnpackError::TooLarge { limit: LIMIT })
    );
}

#[test]
fn a_zip_stands_for_the_one_step_file_in_it() {
    let check = |members: &[(&str, &[u8])], expected: Result<&[u8], UnpackError>| {
        assert_eq!(
            unpacked_step(zipped(members), LIMIT),
            expected.map(<[u8]>::to_vec)
        );
    };
    check(
        &[
            ("readme.txt", b"no"),
            ("a.STP", b"text"),
            ("__MACOSX/._a.STP", b"no"),
        ],
        Ok(b"text"),
    );
    check(&[("model", b"text")], Ok(b"text"));
    check(
        &[("a.step", b"one"), ("b.step", b"two")],
        Err(UnpackError::NotOne { n_steps: 2 }),
    );
    check(
        &[("a.txt", b"one"), ("b.txt", b"two")],
        Err(UnpackError::NotOne { n_steps: 0 }),
    );
    check(&[], Err(UnpackError::NotOne { n_steps: 0 }));
    let tar = unpacked_step(tarred(&[("a.step", b"one")]), LIMIT).unwrap_err();
    assert!(tar.to_string().contains("ends in .tar"), "{tar}");
    let seven = unpacked_step(seven_zipped(&[("a.step", b"one")]), LIMIT).unwrap_err();
    assert!(seven.to_string().contains("ends in .7z"), "{seven}");
}

#[test]
fn the_content_decides_the_kind_for_any_name() {
    for kind in KINDS {
        let bytes = packed(kind, &[("a.step", b"one")]);
        assert_eq!(
            Packing::of_content(bytes.as_slice()).unwrap(),
            Packing::Archive(kind)
        );
    }
    for bytes in &packings(b"text")[..3] {
        assert_eq!(
            Packing::of_content(bytes.as_slice()).unwrap(),
            Packing::OneFile
        );
        assert_eq!(Packing::of_content(&bytes[..8]).unwrap(), Packing::OneFile);
    }
    assert_eq!(Packing::of_content(&b"text"[..]).unwrap(), Packing::Nothing);
    assert_eq!(Packing::of_content(&b""[..]).unwrap(), Packing::Nothing);
}

proptest! {
    #[test]
    fn a_flipped_byte_never_panics(kind in 0usize..6, at in 0usize..4_000, value: u8) {
        let mut bytes = packed(KINDS[kind], &[("a.step", b"one"), ("b.step", &[b'x'; 500])]);
        let at = at % bytes.len();
        bytes[at] = value;
        walked(KINDS[kind], &bytes);
        walked(KINDS[kind], &bytes[..at]);
    }

    #[test]
    fn a_flipped_byte_of_a_packed_file_never_panics(which in 0usize..4, at in 0usize..2_000, value: u8) {
        let mut bytes = packings(&[b'x'; 500])[which].clone();
        let at = at % bytes.len();
        bytes[at] = value;
        let _ = unpacked_step(bytes.clone(), LIMIT);
        let _ = unpacked_step(bytes[..at].to_vec(), LIMIT);
    }
}
