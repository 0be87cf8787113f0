#include <fmt/format.h>

#include <algorithm>

#include "tests/drill/Rows.h"

namespace tessera::drill {

std::string drillScene(std::uint64_t nodes, bool moving) {
    // Rows of rows of rows: 10 nodes with 10 below, each of those with as many pairs as make up the number, less one
    // for all that is not a pair.
    const std::uint64_t row = std::max<std::uint64_t>(2, nodes / 200) - 1;
    std::string text = fmt::format(
        "node {{ name: \"sun\" transform {{ rotation {{ axis {{ x: 1 }} angle_deg: -50 }} }} node {{ directional_light "
        "{{}} }} }}\n"
        "node {{ name: \"mover\" transform {{ translation {{ y: 30 }} }} node {{ box {{ size {{ x: 1 y: 1 z: 1 }} }} "
        "}} }}\n"
        "node {{ transform {{}} repeat {{ count: 10 step {{ y: 2 }} }}\n"
        "  node {{ transform {{}} repeat {{ count: 10 step {{ z: -2 }} }}\n"
        "    node {{ transform {{}} repeat {{ count: {} step {{ x: 2 }} }}\n"
        "      node {{ box {{ size {{ x: 1 y: 1 z: 1 }} }} }} }} }} }}\n",
        row);
    if (moving)
        text +=
            "node { motion { target: \"mover\" mode: PING_PONG key { time: 0 transform { translation { y: 30 } } }\n"
            "  key { time: 10 transform { translation { x: 10 y: 30 } } } } }\n";
    return text;
}

}  // namespace tessera::drill
