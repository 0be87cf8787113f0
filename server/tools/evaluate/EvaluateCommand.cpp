#include "server/tools/evaluate/EvaluateCommand.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "common/base/Version.h"
#include "common/options/Options.h"
#include "server/tools/evaluate/EvaluatedSurface.h"
#include "server/tools/evaluate/ObjControlMesh.h"

namespace tessera {
namespace {

template <typename Number>
bool readNumber(std::string_view word, Number& out) {
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
    return error == std::errc{} && end == word.data() + word.size() && !word.empty();
}

std::string answerLine(const SurfacePoint& p, bool json) {
    const auto list = [](const Vec3d& v) { return fmt::format("[{:.17g},{:.17g},{:.17g}]", v.x(), v.y(), v.z()); };
    const auto words = [](const Vec3d& v) { return fmt::format("{:.9g} {:.9g} {:.9g}", v.x(), v.y(), v.z()); };
    if (json) {
        return fmt::format(R"({{"point":{},"du":{},"dv":{},"normal":{},"error":{:.17g}}})", list(p.point), list(p.du),
                           list(p.dv), list(p.normal), p.error);
    }
    return fmt::format("point {}  du {}  dv {}  normal {}{}", words(p.point), words(p.du), words(p.dv), words(p.normal),
                       p.error > 0 ? fmt::format("  error {:.3g}", p.error) : "");
}

std::string answerLine(const NearestPoint& p, bool json) {
    if (json)
        return fmt::format(R"({{"face":{},"u":{:.17g},"v":{:.17g},"point":[{:.17g},{:.17g},{:.17g}],)"
                           R"("distance":{:.17g},"error":{:.17g}}})",
                           p.face, p.u, p.v, p.point.x(), p.point.y(), p.point.z(), p.distance, p.error);
    return fmt::format("face {} at {:.9g} {:.9g}  point {:.9g} {:.9g} {:.9g}  distance {:.9g}  error {:.3g}", p.face,
                       p.u, p.v, p.point.x(), p.point.y(), p.point.z(), p.distance, p.error);
}

Expected<void> tellNearest(EvaluatedSurface& surface, const EvaluateArguments& arguments, std::string_view text) {
    const Expected<std::vector<SpaceLine>> places = parseSpacePlaces(text, arguments.places);
    if (!places) return tl::unexpected(places.error());
    for (const SpaceLine& place : *places) {
        const Expected<NearestPoint> point = surface.nearest(place.place, arguments.tolerance);
        if (!point)
            return fail(point.error().code,
                        fmt::format("{}:{}: {}", arguments.places, place.line, point.error().message));
        fmt::print("{}\n", answerLine(*point, arguments.json));
    }
    return {};
}

Expected<void> evaluateFile(const EvaluateArguments& arguments) {
    const Expected<std::string> text = readSurfaceText(arguments.surface);
    if (!text) return tl::unexpected(text.error());
    const auto schemes = surfaceSchemes();
    const auto scheme = std::find_if(schemes.begin(), schemes.end(),
                                     [&](const SurfaceScheme& s) { return s.name == arguments.scheme; });
    Expected<std::unique_ptr<EvaluatedSurface>> surface = scheme->load(*text, arguments.surface);
    if (!surface) return tl::unexpected(surface.error());
    for (const std::string& note : (*surface)->notes())
        fmt::print(stderr, "tessera-evaluate: {}: {}\n", arguments.surface, note);
    const Expected<std::string> placesText = readSurfaceText(arguments.places);
    if (!placesText) return tl::unexpected(placesText.error());
    if (arguments.nearest) return tellNearest(**surface, arguments, *placesText);
    const Expected<std::vector<PlaceLine>> places = parsePlaces(*placesText, arguments.places);
    if (!places) return tl::unexpected(places.error());
    for (const PlaceLine& place : *places) {
        const Expected<SurfacePoint> point = (*surface)->at(place.face, place.u, place.v);
        if (!point)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}:{}: {}", arguments.places, place.line, point.error().message));
        fmt::print("{}\n", answerLine(*point, arguments.json));
    }
    return {};
}

}  // namespace

Expected<std::variant<EvaluateArguments, EvaluateText>> parseEvaluateArguments(const std::vector<std::string>& words) {
    EvaluateArguments out;
    Options options("tessera-evaluate",
                    "Points, derivatives and normals of a smooth surface by its parameters: a line\n"
                    "'face u v' each. Faces are numbered as OpenSubdiv's ptex faces: a quadrilateral\n"
                    "is one, another polygon as many as it has corners, a triangle of Loop's scheme\n"
                    "one with corners (0, 0), (1, 0), (0, 1). Of NURBS the n-th surface of the file\n"
                    "is n, from 0, and u and v are those of its knots.",
                    versionText("tessera-evaluate"));
    std::string names;
    for (const SurfaceScheme& scheme : surfaceSchemes())
        names += (names.empty() ? "" : ", ") + std::string(scheme.name);
    options.option(
        "SURFACE", out.surface,
        "Wavefront OBJ, with the tags of\nOpenSubdiv's shapes (t crease …), or\nwith free-form surfaces (surf, trim)");
    options.option("--at", out.places, "The places, one a line; # begins a\ncomment").typeName("FILE");
    std::string nearest;
    options
        .option("--nearest", nearest,
                "Instead: places in space, 'x y z' a line;\nof each the nearest point of the surface\n(catmull-clark, "
                "nurbs)")
        .typeName("FILE");
    const Option tolerance =
        options.option("--tolerance", out.tolerance, "Of --nearest: the error that is aimed at\n(1e-6)").typeName("T");
    options.option("--scheme", out.scheme, names).typeName("NAME");
    options.flag("--json", out.json, "One JSON object per place");
    const Expected<std::optional<std::string>> instead = options.read(words);
    if (!instead) return fail(instead.error().code, instead.error().message + "; see --help");
    if (*instead) return EvaluateText{**instead};
    if (out.surface.empty()) return fail(ErrorCode::kUsage, "name a SURFACE; see --help");
    if (!nearest.empty() && !out.places.empty()) return fail(ErrorCode::kUsage, "--at or --nearest, not both");
    out.nearest = !nearest.empty();
    if (out.nearest) out.places = nearest;
    if (out.places.empty()) return fail(ErrorCode::kUsage, "say where with --at FILE or --nearest FILE; see --help");
    if (tolerance.given() && !out.nearest) return fail(ErrorCode::kUsage, "--tolerance is for --nearest");
    if (!(out.tolerance > 0 && std::isfinite(out.tolerance)))
        return fail(ErrorCode::kUsage, "--tolerance must be a number above 0");
    const auto schemes = surfaceSchemes();
    if (out.scheme.empty()) out.scheme = schemes.front().name;
    if (std::none_of(schemes.begin(), schemes.end(), [&](const SurfaceScheme& s) { return s.name == out.scheme; })) {
        return fail(ErrorCode::kUsage, fmt::format("--scheme {}: there are {}", out.scheme, names));
    }
    return out;
}

namespace {

/// The words of the next line, and its number; empty ones and comments are passed over. False at the end.
bool nextLine(std::string_view& text, std::size_t& line, std::vector<std::string_view>& words) {
    words.clear();
    while (words.empty()) {
        if (text.empty()) return false;
        ++line;
        std::string_view content = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(content.size() + 1, text.size()));
        content = content.substr(0, content.find('#'));
        constexpr std::string_view kSpace = " \t\r\v\f";
        for (std::size_t begin = content.find_first_not_of(kSpace); begin != std::string_view::npos;
             begin = content.find_first_not_of(kSpace)) {
            content.remove_prefix(begin);
            words.push_back(content.substr(0, content.find_first_of(kSpace)));
            content.remove_prefix(words.back().size());
        }
    }
    return true;
}

}  // namespace

Expected<std::vector<SpaceLine>> parseSpacePlaces(std::string_view text, std::string_view file) {
    std::vector<SpaceLine> places;
    std::vector<std::string_view> words;
    for (std::size_t line = 0; nextLine(text, line, words);) {
        SpaceLine place{.line = line};
        if (words.size() != 3)
            return fail(ErrorCode::kBadInput, fmt::format("{}:{}: a place in space is 'x y z'", file, line));
        for (std::size_t i = 0; i < 3; ++i)
            if (!readNumber(words[i], place.place[static_cast<Eigen::Index>(i)]) ||
                !std::isfinite(place.place[static_cast<Eigen::Index>(i)]))
                return fail(ErrorCode::kBadInput,
                            fmt::format("{}:{}: '{}' is no number", file, line, words[i].substr(0, 40)));
        places.push_back(place);
    }
    return places;
}

Expected<std::vector<PlaceLine>> parsePlaces(std::string_view text, std::string_view file) {
    std::vector<PlaceLine> places;
    std::vector<std::string_view> words;
    for (std::size_t line = 0; nextLine(text, line, words);) {
        PlaceLine place{.line = line};
        if (words.size() != 3)
            return fail(ErrorCode::kBadInput, fmt::format("{}:{}: a place is 'face u v'", file, line));
        if (!readNumber(words[0], place.face)) {
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}:{}: '{}' is no number of a face", file, line, words[0].substr(0, 40)));
        }
        for (const auto& [word, value] : {std::pair(words[1], &place.u), std::pair(words[2], &place.v)}) {
            if (!readNumber(word, *value))
                return fail(ErrorCode::kBadInput,
                            fmt::format("{}:{}: '{}' is no number", file, line, word.substr(0, 40)));
        }
        places.push_back(place);
    }
    return places;
}

int runEvaluate(const std::vector<std::string>& words) {
    const auto parsed = parseEvaluateArguments(words);
    if (!parsed) {
        fmt::print(stderr, "tessera-evaluate: {}\n", parsed.error().message);
        return exitCode(parsed.error().code);
    }
    if (const auto* text = std::get_if<EvaluateText>(&*parsed)) {
        fmt::print("{}", text->text);
        return 0;
    }
    const Expected<void> done = evaluateFile(std::get<EvaluateArguments>(*parsed));
    if (done) return 0;
    fmt::print(stderr, "tessera-evaluate: {}\n", done.error().message);
    return exitCode(done.error().code);
}

}  // namespace tessera
