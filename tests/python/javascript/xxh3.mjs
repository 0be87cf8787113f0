// XXH3-64 with a seed, in plain JavaScript: after xxHash's own scalar code (BSD 2-Clause, Yann Collet). Slow, and
// short.
const M = (1n << 64n) - 1n;
const P32 = [0x9e3779b1n, 0x85ebca77n, 0xc2b2ae3dn];
const P64 = [0x9e3779b185ebca87n, 0xc2b2ae3d27d4eb4fn, 0x165667b19e3779f9n, 0x85ebca77c2b2ae63n, 0x27d4eb2f165667c5n];
const SECRET = Buffer.from(
    'b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671fcb79e64eccc0e578825ad07dccff7221' +
    'b8084674f743248ee03590e6813a264c3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8' +
    'a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364eac5ac8334d3ebc3c581a0fffa1363eb' +
    '170ddd51b7f0da49d316552629d4689e2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e', 'hex');

const u32 = (bytes, at) => BigInt(bytes.readUInt32LE(at));
const u64 = (bytes, at) => bytes.readBigUInt64LE(at);
const shifted = (x, by) => x ^ (x >> by);
const turned = (x, by) => ((x << by) | (x >> (64n - by))) & M;
const folded = (a, b) => { const p = a * b; return (p & M) ^ (p >> 64n); };
const swapped = (x, bytes) => BigInt('0x' + x.toString(16).padStart(2 * bytes, '0').match(/../g).reverse().join(''));
const avalanche = x => shifted((shifted(x, 37n) * 0x165667919e3779f9n) & M, 32n);
const avalanche64 = x => {
    x = (shifted(x, 33n) * P64[1]) & M;
    x = (shifted(x, 29n) * P64[2]) & M;
    return shifted(x, 32n);
};

function short(data, seed) {
    const n = data.length, length = BigInt(n);
    if (n > 8) {
        const low = u64(data, 0) ^ (((u64(SECRET, 24) ^ u64(SECRET, 32)) + seed) & M);
        const high = u64(data, n - 8) ^ (((u64(SECRET, 40) ^ u64(SECRET, 48)) - seed) & M);
        return avalanche((length + swapped(low, 8) + high + folded(low, high)) & M);
    }
    if (n >= 4) {
        seed ^= swapped(seed & 0xffffffffn, 4) << 32n;
        let x = (u32(data, n - 4) + (u32(data, 0) << 32n)) ^ (((u64(SECRET, 8) ^ u64(SECRET, 16)) - seed) & M);
        x ^= turned(x, 49n) ^ turned(x, 24n);
        x = (x * 0x9fb21c651e98df25n) & M;
        x ^= ((x >> 35n) + length) & M;
        return shifted((x * 0x9fb21c651e98df25n) & M, 28n);
    }
    if (n > 0) {
        const all = (BigInt(data[0]) << 16n) | (BigInt(data[n >> 1]) << 24n) | BigInt(data[n - 1]) | (length << 8n);
        return avalanche64(all ^ (((u32(SECRET, 0) ^ u32(SECRET, 4)) + seed) & M));
    }
    return avalanche64(seed ^ u64(SECRET, 56) ^ u64(SECRET, 64));
}

const mixed = (data, at, secret, seed) =>
    folded(u64(data, at) ^ ((u64(SECRET, secret) + seed) & M),
        u64(data, at + 8) ^ ((u64(SECRET, secret + 8) - seed) & M));

function middle(data, seed) {
    const n = data.length;
    let sum = BigInt(n) * P64[0];
    if (n <= 128) {
        for (let i = Math.floor((n - 1) / 32); i >= 0; --i)
            sum += mixed(data, 16 * i, 32 * i, seed) + mixed(data, n - 16 * (i + 1), 32 * i + 16, seed);
        return avalanche(sum & M);
    }
    for (let i = 0; i < 8; ++i) sum += mixed(data, 16 * i, 16 * i, seed);
    sum = avalanche(sum & M);
    for (let i = 8; i < n >> 4; ++i) sum += mixed(data, 16 * i, 16 * (i - 8) + 3, seed);
    return avalanche((sum + mixed(data, n - 16, 136 - 17, seed)) & M);
}

function long(data, seed) {
    const secret = Buffer.alloc(192);
    for (let at = 0; at < 192; at += 16) {
        secret.writeBigUInt64LE((u64(SECRET, at) + seed) & M, at);
        secret.writeBigUInt64LE((u64(SECRET, at + 8) - seed) & M, at + 8);
    }
    const sums = [P32[2], P64[0], P64[1], P64[2], P64[3], P32[1], P64[4], P32[0]];
    const add = (at, from) => {
        for (let i = 0; i < 8; ++i) {
            const value = u64(data, at + 8 * i), key = value ^ u64(secret, from + 8 * i);
            sums[i ^ 1] = (sums[i ^ 1] + value) & M;
            sums[i] = (sums[i] + (key & 0xffffffffn) * (key >> 32n)) & M;
        }
    };
    const stripes = (192 - 64) / 8, block = 64 * stripes, blocks = Math.floor((data.length - 1) / block);
    for (let b = 0; b < blocks; ++b) {
        for (let s = 0; s < stripes; ++s) add(b * block + 64 * s, 8 * s);
        for (let i = 0; i < 8; ++i) sums[i] = ((shifted(sums[i], 47n) ^ u64(secret, 128 + 8 * i)) * P32[0]) & M;
    }
    const left = Math.floor((data.length - 1 - block * blocks) / 64);
    for (let s = 0; s < left; ++s) add(blocks * block + 64 * s, 8 * s);
    add(data.length - 64, 192 - 64 - 7);
    let sum = BigInt(data.length) * P64[0];
    for (let i = 0; i < 4; ++i)
        sum += folded(sums[2 * i] ^ u64(secret, 11 + 16 * i), sums[2 * i + 1] ^ u64(secret, 19 + 16 * i));
    return avalanche(sum & M);
}

export function xxh3(data, seed = 0n) {
    return data.length <= 16 ? short(data, seed) : data.length <= 240 ? middle(data, seed) : long(data, seed);
}
