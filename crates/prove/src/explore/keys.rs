//! The keys of states in the set of visited states: 128 bits.
//!
//! A state of up to 16 bytes is its own key. The key of a longer one is a hash (MurmurHash3,
//! x64_128, by Austin Appleby, in the public domain): of a hundred million states, the probability
//! that any two have the same key is about 10^-23.

/// The key of a state. All states of a search have the same length.
pub(super) fn key(state: &[u8]) -> u128 {
    if state.len() <= 16 {
        let mut bytes = [0; 16];
        bytes[..state.len()].copy_from_slice(state);
        return u128::from_le_bytes(bytes);
    }
    murmur3(state)
}

const C1: u64 = 0x87c3_7b91_1142_53d5;
const C2: u64 = 0x4cf5_ad43_2745_937f;

fn murmur3(bytes: &[u8]) -> u128 {
    let (mut h1, mut h2) = (0u64, 0u64);
    let (blocks, rest) = bytes.as_chunks::<16>();
    for block in blocks {
        let (k1, k2) = halves(*block);
        h1 = (h1 ^ mixed1(k1)).rotate_left(27).wrapping_add(h2);
        h1 = h1.wrapping_mul(5).wrapping_add(0x52dc_e729);
        h2 = (h2 ^ mixed2(k2)).rotate_left(31).wrapping_add(h1);
        h2 = h2.wrapping_mul(5).wrapping_add(0x3849_5ab5);
    }
    let mut last = [0; 16];
    last[..rest.len()].copy_from_slice(rest);
    let (k1, k2) = halves(last);
    (h1, h2) = (h1 ^ mixed1(k1), h2 ^ mixed2(k2));
    let length = bytes.len() as u64;
    (h1, h2) = (h1 ^ length, h2 ^ length);
    h1 = h1.wrapping_add(h2);
    h2 = h2.wrapping_add(h1);
    (h1, h2) = (finished(h1), finished(h2));
    h1 = h1.wrapping_add(h2);
    h2 = h2.wrapping_add(h1);
    u128::from(h2) << 64 | u128::from(h1)
}

fn halves(block: [u8; 16]) -> (u64, u64) {
    let all = u128::from_le_bytes(block);
    (all as u64, (all >> 64) as u64)
}

fn mixed1(k: u64) -> u64 {
    k.wrapping_mul(C1).rotate_left(31).wrapping_mul(C2)
}

fn mixed2(k: u64) -> u64 {
    k.wrapping_mul(C2).rotate_left(33).wrapping_mul(C1)
}

fn finished(mut h: u64) -> u64 {
    h ^= h >> 33;
    h = h.wrapping_mul(0xff51_afd7_ed55_8ccd);
    h ^= h >> 33;
    h = h.wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    h ^ h >> 33
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_murmur3() {
        let text = b"The quick brown fox jumps over the lazy dog";
        assert_eq!(murmur3(text), 0x7a43_3ca9_c49a_9347_e34b_bc7b_bc07_1b6c);
    }

    #[test]
    fn a_short_state_is_its_own_key() {
        assert_eq!(key(&[1, 2]), 0x0201);
    }
}
