#include "server/import/reader/Pictures.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {

Expected<proto::scene::Image*> Pictures::addImage(const std::string& name, const std::string& picture,
                                                  const std::function<Expected<DecodedImage>()>& decode) {
    auto known = pictures_.find(picture);
    if (known == pictures_.end()) {
        known = pictures_.emplace(picture, Picture{decode(), {}}).first;
        if (known->second.decoded) bytes_ += known->second.decoded->rgba.size();
        while (bytes_ > limits_.maxImageBytes) halveLargest();
    }
    if (!known->second.decoded) return tl::unexpected(known->second.decoded.error());
    proto::scene::Image* image = scene_.file.add_image();
    image->set_name(name);
    known->second.images.push_back(image);
    return image;
}

void Pictures::halveLargest() {
    const auto sizeOf = [](const auto& entry) {
        return entry.second.decoded ? entry.second.decoded->rgba.size() : 0;
    };
    const auto largest = std::max_element(pictures_.begin(), pictures_.end(),
                                          [&](const auto& a, const auto& b) { return sizeOf(a) < sizeOf(b); });
    bytes_ -= sizeOf(*largest);
    halve(*largest->second.decoded);
    bytes_ += sizeOf(*largest);
}

void Pictures::finish() {
    for (auto& [name, picture] : pictures_) {
        if (!picture.decoded) continue;
        DecodedImage& decoded = *picture.decoded;
        if (decoded.halved)
            scene_.note(fmt::format("{} was reduced to {} × {} pixels", name, decoded.widthPx, decoded.heightPx));
        const std::uint32_t blob = scene_.addBlob(std::move(decoded.rgba));
        for (proto::scene::Image* image : picture.images) {
            image->set_width_px(static_cast<std::uint32_t>(decoded.widthPx));
            image->set_height_px(static_cast<std::uint32_t>(decoded.heightPx));
            image->set_pixels_blob(blob);
            if (decoded.rgbe) image->set_encoding(proto::scene::Image::RGBE);
        }
    }
}

}  // namespace tessera
