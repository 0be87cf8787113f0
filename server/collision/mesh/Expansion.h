/// Exact sums of doubles, the ground under the predicates (J. R. Shewchuk, "Adaptive Precision Floating-Point
/// Arithmetic and Fast Robust Geometric Predicates", 1997).
///
/// An expansion is a sum of doubles that do not overlap in their bits, smallest first; zeros are left out. Sums and
/// products of expansions are exact as long as nothing overflows or underflows. Needs IEEE doubles rounded to nearest
/// and no contraction of a*b+c: include it only from files compiled with -ffp-contract=off.
#pragma once

#include <cmath>
#include <cstddef>

namespace tessera::exact {

/// A value and what its rounding lost: high + low is exact.
struct Rounded {
    double high;
    double low;
};

[[nodiscard]] inline Rounded add(double a, double b) {
    const double x = a + b;
    const double bVirtual = x - a;
    const double aVirtual = x - bVirtual;
    return {x, (a - aVirtual) + (b - bVirtual)};
}

/// Needs |a| >= |b| (or a = 0).
[[nodiscard]] inline Rounded addOrdered(double a, double b) {
    const double x = a + b;
    return {x, b - (x - a)};
}

/// Two halves of a double, 26 bits each (Dekker).
[[nodiscard]] inline Rounded split(double a) {
    constexpr double kSplitter = 134217729.0;  // 2^27 + 1
    const double c = kSplitter * a;
    const double high = c - (c - a);
    return {high, a - high};
}

[[nodiscard]] inline Rounded multiply(double a, double b) {
    const double x = a * b;
    const Rounded sa = split(a);
    const Rounded sb = split(b);
    const double e1 = x - sa.high * sb.high;
    const double e2 = e1 - sa.low * sb.high;
    const double e3 = e2 - sa.high * sb.low;
    return {x, sa.low * sb.low - e3};
}

/// Room for Capacity terms; `size` of them are used.
template <int Capacity>
struct Expansion {
    double terms[Capacity];
    int size = 0;

    void push(double term) {
        if (term != 0.0) terms[size++] = term;
    }
    /// The biggest term outweighs all others together, so it has the sum's sign.
    [[nodiscard]] int sign() const {
        if (size == 0) return 0;
        return terms[size - 1] > 0 ? 1 : -1;
    }
};

[[nodiscard]] inline Expansion<2> difference(double a, double b) {
    const Rounded d = add(a, -b);
    Expansion<2> out;
    out.push(d.low);
    out.push(d.high);
    return out;
}

/// Shewchuk's Fast-Expansion-Sum of two lists of terms: merge by magnitude, then carry upwards. `push` takes terms of
/// the sum, smallest first, zeros too.
template <typename Push>
inline void sumTerms(const double* e, std::size_t eSize, const double* f, std::size_t fSize, Push&& push) {
    std::size_t i = 0, j = 0;
    const auto next = [&] {
        if (j == fSize || (i < eSize && std::fabs(e[i]) < std::fabs(f[j]))) return e[i++];
        return f[j++];
    };
    const std::size_t total = eSize + fSize;
    if (total == 0) return;
    double carry = next();
    for (std::size_t k = 1; k < total; ++k) {
        const Rounded r = add(carry, next());
        push(r.low);
        carry = r.high;
    }
    push(carry);
}

/// Shewchuk's Scale-Expansion, likewise.
template <typename Push>
inline void scaleTerms(const double* e, std::size_t size, double b, Push&& push) {
    if (size == 0 || b == 0.0) return;
    Rounded q = multiply(e[0], b);
    push(q.low);
    for (std::size_t i = 1; i < size; ++i) {
        const Rounded product = multiply(e[i], b);
        const Rounded lower = add(q.high, product.low);
        push(lower.low);
        q = addOrdered(product.high, lower.high);
        push(q.low);
    }
    push(q.high);
}

template <int N, int M>
[[nodiscard]] Expansion<N + M> sum(const Expansion<N>& e, const Expansion<M>& f) {
    Expansion<N + M> out;
    sumTerms(e.terms, static_cast<std::size_t>(e.size), f.terms, static_cast<std::size_t>(f.size),
             [&](double t) { out.push(t); });
    return out;
}

template <int N>
[[nodiscard]] Expansion<N> negated(Expansion<N> e) {
    for (int i = 0; i < e.size; ++i) e.terms[i] = -e.terms[i];
    return e;
}

template <int N>
[[nodiscard]] Expansion<2 * N> scaled(const Expansion<N>& e, double b) {
    Expansion<2 * N> out;
    scaleTerms(e.terms, static_cast<std::size_t>(e.size), b, [&](double t) { out.push(t); });
    return out;
}

/// e times a two-term expansion.
template <int N>
[[nodiscard]] Expansion<4 * N> product(const Expansion<N>& e, const Expansion<2>& f) {
    Expansion<2 * N> low;
    Expansion<2 * N> high;
    if (f.size > 0) high = scaled(e, f.terms[f.size - 1]);
    if (f.size > 1) low = scaled(e, f.terms[0]);
    return sum(low, high);
}

}  // namespace tessera::exact
