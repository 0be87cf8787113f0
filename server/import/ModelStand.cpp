#include "server/import/ModelStand.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#include "server/import/FlatCloud.h"

namespace tessera {
namespace {

/// What the reader tells of a model's axes (proto/scene.proto).
constexpr std::uint32_t kSaysYUp = 2, kSaysZUp = 3;

/// Formats that say nothing of it, and come from where Z is up: parts to be made.
bool mostlyZUp(const std::string& path) {
    const std::string ending = path.substr(std::min(path.rfind('.'), path.size()));
    constexpr std::array<std::string_view, 2> kEndings = {".stl", ".off"};
    return std::ranges::any_of(kEndings, [&](std::string_view known) {
        return std::ranges::equal(ending, known, [](unsigned char a, char b) { return std::tolower(a) == b; });
    });
}

}  // namespace

Transform standOf(SceneDraft& draft, const LoadedFile& file, const Placing& placing) {
    Transform place;
    UpAxis up = placing.up;
    if (up == UpAxis::kOfFile) {
        const bool says = file.isScene || file.content.up_axis() == kSaysZUp || file.content.up_axis() == kSaysYUp;
        const bool flat = !says && !mostlyZUp(file.path) && isFlatCloud(file);
        const bool z = says ? file.content.up_axis() == kSaysZUp : flat || mostlyZUp(file.path);
        up = z ? UpAxis::kZ : UpAxis::kY;
        if (!says)
            draft.note(fmt::format("{}: it does not say which way is up{}; {} is taken to be (--up {} says otherwise)",
                                   file.label, flat ? ", and its points lie flat as if seen from above" : "",
                                   z ? "+Z" : "+Y", z ? "y" : "z"));
    }
    if (up == UpAxis::kZ) place.rotation = Quatd(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);  // Z comes to Y
    if (placing.at && !placing.fit) place.translation = *placing.at;  // with `fit`: once it is known how large it is
    if (placing.scale) place.scale = Vec3d::Constant(*placing.scale);
    return place;
}

}  // namespace tessera
