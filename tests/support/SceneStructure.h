/// Whether two scenes are the same but for their ids.
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

/// The first difference in words, or nothing. Compares what is below two nodes and whatever that refers to: types,
/// values, arrays, order of children, and which objects are shared. The two nodes' own name and core are compared with
/// `tops` only.
inline std::string structureDifference(const Aspect& a, const Aspect& b, ObjectId topA = kRootNode,
                                       ObjectId topB = kRootNode, bool tops = true) {
    std::map<ObjectId, ObjectId> toB, toA;
    std::vector<std::pair<ObjectId, ObjectId>> open;
    const auto pair = [&](ObjectId x, ObjectId y) {
        if (!x || !y) return x == y;
        const auto [atB, newB] = toB.try_emplace(x, y);
        const auto [atA, newA] = toA.try_emplace(y, x);
        if (newB && newA) open.emplace_back(x, y);
        return atB->second == y && atA->second == x;
    };
    (void)pair(topA, topB);
    while (!open.empty()) {
        const ObjectId x = open.back().first, y = open.back().second;
        open.pop_back();
        const Object left = a.find(x), right = b.find(y);
        const auto say = [&](std::string_view what) {
            return fmt::format("#{} and #{} ({}): {}", x.value, y.value, left.info().name, what);
        };
        if (left.info().type != right.info().type) return say(fmt::format("the other is a {}", right.info().name));
        if (x != topA || tops)
            for (const FieldEntry& field : left.info().fields) {
                const FieldValue u = field.load(left), v = field.load(right);
                if (const auto* ref = std::get_if<ObjectId>(&u)) {
                    if (!pair(*ref, std::get<ObjectId>(v))) return say(fmt::format("{} leads elsewhere", field.name));
                } else if (const auto* refs = std::get_if<RefList>(&u)) {
                    const RefList& others = std::get<RefList>(v);
                    if (refs->size() != others.size()) return say(fmt::format("{} has another length", field.name));
                    for (std::size_t i = 0; i < refs->size(); ++i)
                        if (!pair((*refs)[i], others[i])) return say(fmt::format("{} leads elsewhere", field.name));
                } else if (u != v) {
                    return say(fmt::format("{} differs", field.name));
                }
            }
        if (const Node* node = left.as<Node>()) {
            const Node& other = *right.as<Node>();
            if (node->children.size() != other.children.size())
                return say(fmt::format("{} children, {} in the other", node->children.size(), other.children.size()));
            for (std::size_t i = 0; i < node->children.size(); ++i)
                if (!pair(node->children[i], other.children[i])) return say("children differ");
        }
    }
    return {};
}

}  // namespace tessera
