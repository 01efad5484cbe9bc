//! What an image takes of the chip's memories, from the section headers of its file (ELF for ARM: 32 bits, little endian;
//! System V ABI, chapter 4).

/// Bytes of memory that an image takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    /// Code, constants and the initial values of variables.
    pub flash: u64,
    /// Variables, set or not at the start; the stack is not among them.
    pub ram: u64,
}

/// The section lies in the chip's memory (`SHF_ALLOC`).
const ALLOCATED: u32 = 2;
/// The section has no bytes in the file (`SHT_NOBITS`).
const NO_BITS: u32 = 8;
/// Where a Cortex-M has its RAM (ARMv7-M Architecture Reference Manual, B3.1).
const RAM: std::ops::Range<u32> = 0x2000_0000..0x4000_0000;

/// The sizes of an image, from its file's bytes.
///
/// # Errors
/// When it is not such a file.
pub fn sizes(file: &[u8]) -> Result<Sizes, String> {
    if !file.starts_with(b"\x7fELF\x01\x01") {
        return Err("not an ELF file of 32 bits, little endian".into());
    }
    let headers = word(file, 32)? as usize;
    let size = half(file, 46)? as usize;
    let count = half(file, 48)? as usize;
    if count == 0 {
        return Err("the file has no section headers".into());
    }
    let mut sizes = Sizes::default();
    for header in (0..count).map(|n| headers.saturating_add(n * size)) {
        let field = |n: usize| word(file, header.saturating_add(4 * n));
        let (kind, flags, address, bytes) = (field(1)?, field(2)?, field(3)?, field(5)?);
        if flags & ALLOCATED == 0 {
            continue;
        }
        if kind != NO_BITS {
            sizes.flash += u64::from(bytes);
        }
        if RAM.contains(&address) {
            sizes.ram += u64::from(bytes);
        }
    }
    Ok(sizes)
}

fn word(file: &[u8], at: usize) -> Result<u32, String> {
    bytes(file, at).map(u32::from_le_bytes)
}

fn half(file: &[u8], at: usize) -> Result<u16, String> {
    bytes(file, at).map(u16::from_le_bytes)
}

fn bytes<const N: usize>(file: &[u8], at: usize) -> Result<[u8; N], String> {
    let found = at.checked_add(N).and_then(|end| file.get(at..end)).and_then(|bytes| bytes.try_into().ok());
    found.ok_or_else(|| format!("the file ends before byte {at}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with these sections: type, flags, address, size.
    fn file(sections: &[[u32; 4]]) -> Vec<u8> {
        let mut file = vec![0; 52];
        file[..6].copy_from_slice(b"\x7fELF\x01\x01");
        file[32..36].copy_from_slice(&52u32.to_le_bytes());
        file[46..48].copy_from_slice(&40u16.to_le_bytes());
        file[48..50].copy_from_slice(&(sections.len() as u16).to_le_bytes());
        for [kind, flags, address, size] in sections {
            for field in [0, *kind, *flags, *address, 0, *size, 0, 0, 0, 0] {
                file.extend_from_slice(&field.to_le_bytes());
            }
        }
        file
    }

    #[test]
    fn flash_holds_code_and_initial_values_and_ram_all_variables() {
        let sections = [
            [0, 0, 0, 0],
            [1, 2, 0x0800_0000, 1000],
            [1, 6, 0x0800_03e8, 200],
            [1, 3, 0x2000_0000, 30],
            [NO_BITS, 3, 0x2000_001e, 4000],
            [1, 0, 0, 500_000],
        ];
        assert_eq!(sizes(&file(&sections)), Ok(Sizes { flash: 1230, ram: 4030 }));
    }

    #[test]
    fn what_is_no_image_is_refused() {
        let whole = file(&[[1, 2, 0x0800_0000, 1000]]);
        assert!(sizes(b"").is_err());
        assert!(sizes(&file(&[])).is_err());
        assert!(sizes(&whole[..whole.len() - 20]).is_err());
        let mut of_64_bits = whole.clone();
        of_64_bits[4] = 2;
        assert!(sizes(&of_64_bits).is_err());
        let mut far = whole;
        far[32..36].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(sizes(&far).is_err());
    }
}
