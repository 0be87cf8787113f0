/// Numbers without rounding error, of any length: for the few decisions that ordinary double leaves in doubt.
#pragma once

#include <utility>
#include <vector>

#include "server/collision/mesh/Expansion.h"

namespace tessera::exact {

/// An expansion (Expansion.h) whose length is known at run time. Kept short: after each operation it is compressed
/// (J. R. Shewchuk 1997, figure 15), so a polynomial takes about as many terms as its bits fill doubles.
class Sum {
public:
    Sum() = default;
    Sum(double value) {  // NOLINT: a double is such a number
        if (value != 0) terms_.push_back(value);
    }
    [[nodiscard]] static Sum difference(double a, double b) {
        Sum out;
        const Rounded d = add(a, -b);
        if (d.low != 0) out.terms_.push_back(d.low);
        if (d.high != 0) out.terms_.push_back(d.high);
        return out;
    }

    [[nodiscard]] int sign() const { return terms_.empty() ? 0 : (terms_.back() > 0 ? 1 : -1); }
    /// To within a unit in the last place.
    [[nodiscard]] double rounded() const {
        double sum = 0;
        for (const double t : terms_) sum += t;
        return sum;
    }

    friend Sum operator+(const Sum& e, const Sum& f) {
        if (e.terms_.empty()) return f;
        if (f.terms_.empty()) return e;
        Sum out = merged(e, f);
        out.compress();
        return out;
    }
    friend Sum operator-(Sum e) {
        for (double& t : e.terms_) t = -t;
        return e;
    }
    friend Sum operator-(const Sum& e, const Sum& f) { return e + -f; }
    friend Sum operator*(const Sum& e, const Sum& f) {
        Sum out;
        for (const double t : f.terms_) {
            Sum part = scaled(e, t);
            out = out.terms_.empty() ? std::move(part) : merged(out, part);
        }
        out.compress();
        return out;
    }

private:
    void push(double term) {
        if (term != 0) terms_.push_back(term);
    }

    [[nodiscard]] static Sum merged(const Sum& e, const Sum& f) {
        Sum out;
        out.terms_.reserve(e.terms_.size() + f.terms_.size());
        sumTerms(e.terms_.data(), e.terms_.size(), f.terms_.data(), f.terms_.size(), [&](double t) { out.push(t); });
        return out;
    }
    [[nodiscard]] static Sum scaled(const Sum& e, double b) {
        Sum out;
        out.terms_.reserve(2 * e.terms_.size());
        scaleTerms(e.terms_.data(), e.terms_.size(), b, [&](double t) { out.push(t); });
        return out;
    }

    void compress() {
        if (terms_.size() < 2) return;
        // Downwards: gather into as few terms as will do; upwards: let each carry into the next.
        std::size_t bottom = terms_.size() - 1;
        double carry = terms_.back();
        for (std::size_t i = terms_.size() - 1; i-- > 0;) {
            const Rounded r = addOrdered(carry, terms_[i]);
            if (r.low != 0) {
                terms_[bottom--] = r.high;
                carry = r.low;
            } else {
                carry = r.high;
            }
        }
        terms_[bottom] = carry;
        std::size_t top = 0;
        for (std::size_t i = bottom + 1; i < terms_.size(); ++i) {
            const Rounded r = addOrdered(terms_[i], carry);
            if (r.low != 0) terms_[top++] = r.low;
            carry = r.high;
        }
        terms_[top] = carry;
        terms_.resize(carry != 0 ? top + 1 : top);
    }

    std::vector<double> terms_;  ///< smallest first, none zero
};

}  // namespace tessera::exact
