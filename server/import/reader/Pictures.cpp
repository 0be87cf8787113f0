#include "server/import/reader/Pictures.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/confine/Confinement.h"

namespace tessera {

Expected<DecodedImage> Pictures::decode(ByteSpan encoded) {
    pool_.grant(bytesGranted());
    return decodeImage(encoded, limits_.maxImageSide, pool_);
}

Expected<proto::scene::Image*> Pictures::addImage(const std::string& name, const std::string& picture,
                                                  const std::function<Expected<DecodedImage>()>& decode) {
    auto known = pictures_.find(picture);
    if (known == pictures_.end()) {
        known = pictures_.emplace(picture, Picture{decode(), {}}).first;
        if (known->second.decoded) bytes_ += known->second.decoded->rgba.size();
        while (bytes_ > limits_.maxImageBytes && halveLargest()) {
        }
    }
    if (!known->second.decoded) return tl::unexpected(known->second.decoded.error());
    proto::scene::Image* image = scene_.file.add_image();
    image->set_name(name);
    known->second.images.push_back(image);
    return image;
}

bool Pictures::halveLargest() {
    // Of compressed ones without mipmaps there is nothing smaller: how large those are together the files' own sizes
    // bound.
    const auto sizeOf = [](const auto& entry) {
        const Expected<DecodedImage>& decoded = entry.second.decoded;
        return decoded && !(decoded->compressed() && decoded->mipmaps == 1) ? decoded->rgba.size() : 0;
    };
    const auto largest = std::max_element(pictures_.begin(), pictures_.end(),
                                          [&](const auto& a, const auto& b) { return sizeOf(a) < sizeOf(b); });
    const std::size_t before = sizeOf(*largest);
    if (before == 0 || !halve(*largest->second.decoded)) return false;
    bytes_ -= before - largest->second.decoded->rgba.size();
    return true;
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
            if (decoded.encoding != proto::scene::Image::SRGB) image->set_encoding(decoded.encoding);
            if (decoded.shape != proto::scene::Image::FLAT) image->set_shape(decoded.shape);
            if (decoded.depthPx > 1) image->set_depth_px(decoded.depthPx);
            if (decoded.mipmaps > 1) image->set_mipmaps(decoded.mipmaps);
        }
    }
}

}  // namespace tessera
