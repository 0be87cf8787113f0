#include "common/session/MachineBoards.h"

#include <algorithm>

namespace tessera {

MachineBoards::Place& MachineBoards::placeOf(const std::string& host) {
    return *std::ranges::find(places_, host, &Place::host);
}

MachineBoards::News MachineBoards::arrives(const std::string& host, const std::string& machine,
                                           const std::string& board) {
    placeOf(host) = {.host = host, .there = true, .machine = machine, .board = board};
    return newsOf(machine);
}

MachineBoards::News MachineBoards::leaves(const std::string& host) {
    Place& place = placeOf(host);
    place.there = false;
    return newsOf(place.machine);
}

void MachineBoards::startOver() {
    for (Place& place : places_) place.machine.clear();
}

MachineBoards::News MachineBoards::newsOf(const std::string& machine) {
    constexpr std::size_t kMostNeighbours = 64, kLongest = 128;  // of a line; bounds what one machine's hosts cost
    News news;
    if (machine.empty()) return news;
    const auto shares = [&](const Place& place) {
        return place.there && place.machine == machine && !place.board.empty() &&
               place.host.size() + place.board.size() < kLongest && place.board.find('\n') == std::string::npos;
    };
    for (Place& place : places_) {
        if (!shares(place)) continue;
        message::Neighbours neighbours;
        std::size_t count = 0;
        for (const Place& other : places_)
            if (&other != &place && shares(other) && count++ < kMostNeighbours)
                neighbours.boards += other.host + " " + other.board + "\n";
        if (neighbours.boards == place.told) continue;
        place.told = neighbours.boards;
        news.emplace_back(place.host, std::move(neighbours));
    }
    return news;
}

}  // namespace tessera
