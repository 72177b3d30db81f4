// Whole numbers of 64 bits as (low, high), and the hash of src/spec/sampling/hash.rs on them.

fn wide_add(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn wide_negate(a: vec2<u32>) -> vec2<u32> {
    return wide_add(~a, vec2<u32>(1u, 0u));
}

fn wide_less(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.y < b.y || a.y == b.y && a.x < b.x;
}

// Shifts by 0 to 63.
fn wide_right(a: vec2<u32>, by: u32) -> vec2<u32> {
    if by == 0u { return a; }
    if by >= 32u { return vec2<u32>(a.y >> (by - 32u), 0u); }
    return vec2<u32>((a.x >> by) | (a.y << (32u - by)), a.y >> by);
}

fn wide_left(a: vec2<u32>, by: u32) -> vec2<u32> {
    if by == 0u { return a; }
    if by >= 32u { return vec2<u32>(0u, a.x << (by - 32u)); }
    return vec2<u32>(a.x << by, (a.y << by) | (a.x >> (32u - by)));
}

// All 64 bits of a product.
fn whole_product(a: u32, b: u32) -> vec2<u32> {
    let low = (a & 0xffffu) * (b & 0xffffu);
    let left = (a >> 16u) * (b & 0xffffu);
    let right = (a & 0xffffu) * (b >> 16u);
    let middle = (low >> 16u) + (left & 0xffffu) + (right & 0xffffu);
    let high = (a >> 16u) * (b >> 16u) + (left >> 16u) + (right >> 16u) + (middle >> 16u);
    return vec2<u32>((middle << 16u) | (low & 0xffffu), high);
}

// The low half of a product.
fn wide_product(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = whole_product(a.x, b.x);
    return vec2<u32>(low.x, low.y + a.x * b.y + a.y * b.x);
}

// The high half of a product, rounded.
fn wide_share(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = whole_product(a.x, b.x);
    let left = whole_product(a.y, b.x);
    let right = whole_product(a.x, b.y);
    var middle = wide_add(vec2<u32>(low.y, 0u), vec2<u32>(left.x, 0u));
    middle = wide_add(middle, vec2<u32>(right.x, 0u));
    middle = wide_add(middle, vec2<u32>(0x80000000u, 0u));
    var high = wide_add(whole_product(a.y, b.y), vec2<u32>(left.y, 0u));
    high = wide_add(high, vec2<u32>(right.y, 0u));
    return wide_add(high, vec2<u32>(middle.y, 0u));
}

// The finaliser of splitmix64.
fn mix(a: vec2<u32>) -> vec2<u32> {
    var x = wide_product(a ^ wide_right(a, 30u), vec2<u32>(0x1ce4e5b9u, 0xbf58476du));
    x = wide_product(x ^ wide_right(x, 27u), vec2<u32>(0x133111ebu, 0x94d049bbu));
    return x ^ wide_right(x, 31u);
}

// The last number of a hash, of which `key` are the first two.
fn hash(key: vec2<u32>, last: vec2<u32>) -> vec2<u32> {
    let moved = wide_add(last, vec2<u32>(0x7f4a7c15u, 0x9e3779b9u));
    return mix(key ^ wide_product(moved, vec2<u32>(0x108ef2d9u, 0xaef17502u)));
}
