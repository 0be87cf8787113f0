/// A table of deeds, made at compile time: what is done for a request of each type.
#pragma once

#include "server/sim/desk/Desk.h"

namespace tessera {

/// Answers a request at once, or opens what answers it later. Returns what the session wants done.
template <typename Request>
using Deed = ServerActions (*)(Desk& desk, const Asker& asker, const Request& wish, TimePoint now);

template <typename Request>
struct DeedRow {
    Deed<Request> deed;
    ServerActions operator()(Desk& desk, const Asker& asker, const Request& wish, TimePoint now) const {
        return deed(desk, asker, wish, now);
    }
};

/// Rows of one topic: `DeedTable{&moveNode, &removeNode}`. Each function says by its parameter which request it is for.
template <typename... Requests>
struct DeedTable : DeedRow<Requests>... {
    using DeedRow<Requests>::operator()...;
    explicit constexpr DeedTable(Deed<Requests>... deeds) : DeedRow<Requests>{deeds}... {}
};

/// All topics together. A request that none has, or two have, does not compile where it is called.
template <typename... Topics>
struct DeedTables : Topics... {
    using Topics::operator()...;
    explicit constexpr DeedTables(const Topics&... topics) : Topics(topics)... {}
};

}  // namespace tessera
