#include "tests/drill/Judgement.h"

#include <fmt/format.h>

#include "tests/drill/FrameTimeline.h"

namespace tessera::drill {
namespace {

void judgeOne(std::vector<std::string>& broken, const char* what, const char* unit, std::optional<double> promised,
              double usual, const std::vector<double>& values) {
    if (!promised) return;
    if (values.empty()) {
        broken.push_back(fmt::format("{}: not measured", what));
        return;
    }
    const double median = quantile(values, 0.5);
    if (median > *promised + usual)
        broken.push_back(
            fmt::format("{}: {:.0f} {}, promised {:.0f}, undisturbed {:.0f}", what, median, unit, *promised, usual));
}

}  // namespace

std::vector<std::string> judge(const Promise& promise, const Measurement& measured) {
    std::vector<std::string> broken = measured.broken;
    judgeOne(broken, "the others missed", "frames", promise.missed, measured.usualMissed, measured.missed);
    judgeOne(broken, "noticed after", "ms", promise.noticedMs, measured.usualGapMs, measured.noticedMs);
    judgeOne(broken, "back after", "ms", promise.backMs, measured.usualGapMs, measured.backMs);
    return broken;
}

}  // namespace tessera::drill
