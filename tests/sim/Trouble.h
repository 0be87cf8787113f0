/// What goes wrong in a random history, and when.
#pragma once

#include "tests/sim/Cluster.h"

namespace tessera::simulation {

/// A whole life of a cluster: hosts come in any order, things go wrong for three seconds, all is repaired, everybody is
/// in step again, and the server ends. Throws a Violation when a law is broken.
class Trouble {
public:
    explicit Trouble(Cluster& cluster) : cluster_(cluster), random_(cluster.random().fork()) {}

    void live();

private:
    void comeInAnyOrder();
    void plan();
    void strike();
    void strikeHost(std::size_t index);
    void repairAll();
    void later(Duration low, Duration high, std::function<void()> what);
    [[nodiscard]] Duration sometime() { return random_.between(0ms, 3'000ms); }

    Cluster& cluster_;
    Random random_;
    bool over_ = false;
};

}  // namespace tessera::simulation
