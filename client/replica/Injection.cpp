#include "client/replica/Injection.h"

#include <charconv>
#include <string>

namespace tessera {
namespace {

bool parseNumber(std::string_view text, std::uint64_t& number) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

}  // namespace

Expected<Injection> parseInjection(std::string_view text) {
    const auto wrong = [&] {
        return fail(ErrorCode::kUsage,
                    "--inject '" + std::string(text) +
                        "': use draw-hang@FRAME, draw-slow@FRAME:MILLISECONDS, draw-fail@FRAME, show-hang@FRAME, "
                        "corrupt@FRAME or lie@FRAME");
    };
    const std::size_t at = text.find('@');
    if (at == std::string_view::npos) return wrong();
    const std::string_view name = text.substr(0, at);
    std::string_view rest = text.substr(at + 1);
    Injection injection;
    if (name == "draw-hang") {
        injection.kind = Injection::Kind::kDrawHang;
    } else if (name == "draw-fail") {
        injection.kind = Injection::Kind::kDrawFail;
    } else if (name == "show-hang") {
        injection.kind = Injection::Kind::kShowHang;
    } else if (name == "corrupt") {
        injection.kind = Injection::Kind::kCorrupt;
    } else if (name == "lie") {
        injection.kind = Injection::Kind::kLie;
    } else if (name == "draw-slow") {
        injection.kind = Injection::Kind::kDrawSlow;
        const std::size_t colon = rest.find(':');
        std::uint64_t milliseconds = 0;
        if (colon == std::string_view::npos || !parseNumber(rest.substr(colon + 1), milliseconds) ||
            milliseconds > 3'600'000)
            return wrong();
        injection.pause = std::chrono::milliseconds(milliseconds);
        rest = rest.substr(0, colon);
    } else {
        return wrong();
    }
    if (!parseNumber(rest, injection.frame)) return wrong();
    return injection;
}

}  // namespace tessera
