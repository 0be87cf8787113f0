/// A type that only the property tests' own build of common/scene holds: kinds of fields that no shipped type has yet.
#pragma once

#include "common/cores/Node.h"

namespace tessera {

struct Probe {
    static constexpr ObjectType kType{60000};
    RefList nodes;
    RefList cores;
    Mat4d matrix = Mat4d::Identity();
    bool flag = true;
    std::int64_t word = 3;
    Blob array;
};
template <>
inline constexpr auto kSaid<Probe> = []<typename T>(Describing<T>) {
    return describe("Probe", field<&T::nodes>(1, "nodes").to(Node::kType), field<&T::cores>(2, "cores"),
                    field<&T::matrix>(3, "matrix"), field<&T::flag>(4, "flag"),
                    field<&T::word>(5, "word").oneOf({{3, "three"}, {5, "five"}, {-7, "minus-seven"}}),
                    field<&T::array>(6, "array"));
};

using ExtraTypes = TypeList<Probe>;

}  // namespace tessera
