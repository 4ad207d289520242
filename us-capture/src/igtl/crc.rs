//! The body's checksum: CRC-64 of ECMA-182, most significant bit first, from zero.

const POLYNOMIAL: u64 = 0x42f0_e1eb_a9ea_3693;

const TABLE: [u64; 256] = table();

const fn table() -> [u64; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u64) << 56;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc >> 63 == 1 { crc << 1 ^ POLYNOMIAL } else { crc << 1 };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// The checksum after more bytes; begin with zero.
pub(super) fn crc64(crc: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(crc, |crc, byte| {
        let index = usize::from((crc >> 56) as u8 ^ byte);
        crc << 8 ^ TABLE.get(index).copied().unwrap_or_default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_check_value_comes_out() {
        // CRC-64/ECMA-182 of "123456789", from the catalogue of parametrised CRC algorithms.
        assert_eq!(crc64(0, b"123456789"), 0x6c40_df5f_0b49_7347);
        assert_eq!(crc64(crc64(0, b"1234"), b"56789"), 0x6c40_df5f_0b49_7347);
    }
}
