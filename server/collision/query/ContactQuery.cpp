#include "server/collision/query/ContactQuery.h"

#include <algorithm>

#include "common/base/Workers.h"

namespace tessera {
namespace {

/// A contact costs some hundred nanoseconds, a task a few of them.
constexpr std::size_t kContactsPerTask = 128;

}  // namespace

BodyContacts contactsBetween(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                             std::size_t most, const TouchOptions& options) {
    FacePairs found = allTouching(a, b, a_T_b, work, options);
    BodyContacts out;
    out.complete = found.complete && found.pairs.size() <= most;
    found.pairs.resize(std::min(most, found.pairs.size()));
    out.contacts.resize(found.pairs.size());
    const auto make = [&](std::size_t task) {
        const std::size_t first = task * kContactsPerTask, end = std::min(found.pairs.size(), first + kContactsPerTask);
        for (std::size_t i = first; i < end; ++i) {
            const FacePair& pair = found.pairs[i];
            out.contacts[i] = {pair,
                               contactOf(a.mesh().triangle(pair.a), transformed(a_T_b, b.mesh().triangle(pair.b)))};
        }
    };
    const std::size_t tasks = (found.pairs.size() + kContactsPerTask - 1) / kContactsPerTask;
    if (options.workers != nullptr) {
        options.workers->run(tasks, make);
    } else {
        for (std::size_t task = 0; task < tasks; ++task) make(task);
    }
    return out;
}

}  // namespace tessera
