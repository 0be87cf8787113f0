#include "client/ctl/TrackingVerbs.h"

#include <fmt/format.h>

#include "client/ctl/TextTable.h"

namespace tessera {

Expected<Answer> run(Application& application, const verb::Trackers&) {
    const Expected<answer::Trackers> told = application.trackers();
    if (!told) return tl::unexpected(told.error());
    if (told->trackers.empty())
        return Answer{"the wall's file names no trackers\n", {{"trackers", nlohmann::ordered_json::array()}}, {}};
    Answer answer;
    nlohmann::ordered_json trackers = nlohmann::ordered_json::array();
    for (const TrackerInfo& tracker : told->trackers) {
        answer.text +=
            fmt::format("{}: {} {}: {} heard, {} of strangers, {} not understood, {} too many{}{}\n", tracker.name,
                        tracker.protocol, tracker.address, tracker.datagrams, tracker.strangers, tracker.malformed,
                        tracker.tooMany, tracker.trouble.empty() ? "" : "; of late: ", tracker.trouble);
        TextTable table({"", "sensor", "moves", "poses", "refused", "Hz", "age ms", "strays mm", "buttons"});
        nlohmann::ordered_json sensors = nlohmann::ordered_json::array();
        for (const SensorInfo& sensor : tracker.sensors) {
            table.add({"", sensor.sensor, sensor.moves.empty() ? "-" : sensor.moves, std::to_string(sensor.poses),
                       std::to_string(sensor.refused), fmt::format("{:.1f}", sensor.rateHz),
                       sensor.ageMs < 0 ? "-" : fmt::format("{:.0f}", sensor.ageMs),
                       fmt::format("{:.2f}", sensor.straysMm), fmt::format("{:b}", sensor.buttons)});
            sensors.push_back({{"sensor", sensor.sensor},
                               {"moves", sensor.moves},
                               {"poses", sensor.poses},
                               {"refused", sensor.refused},
                               {"rate_hz", sensor.rateHz},
                               {"age_ms", sensor.ageMs},
                               {"strays_mm", sensor.straysMm},
                               {"buttons", sensor.buttons}});
        }
        answer.text += table.text();
        trackers.push_back({{"name", tracker.name},
                            {"protocol", tracker.protocol},
                            {"address", tracker.address},
                            {"trouble", tracker.trouble},
                            {"datagrams", tracker.datagrams},
                            {"strangers", tracker.strangers},
                            {"malformed", tracker.malformed},
                            {"too_many", tracker.tooMany},
                            {"sensors", std::move(sensors)}});
    }
    answer.json = {{"trackers", std::move(trackers)}};
    return answer;
}

}  // namespace tessera
