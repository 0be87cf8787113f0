/// The pictures that a scene's images show: each is decoded once, however many images take it.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// All together stay below `ReadLimits::maxImageBytes`: the largest are halved until they do.
class Pictures {
public:
    Pictures(PlainScene& scene, const ReadLimits& limits) : scene_(scene), limits_(limits) {}

    /// A picture's bytes, within the bounds of this file. For `decode` below.
    [[nodiscard]] Expected<DecodedImage> decode(ByteSpan encoded);
    /// A new Image of this name in the scene, without pixels before `finish`. `picture` is what notes call the picture,
    /// a name for each; `decode` is called the first time. An error is the same each time.
    Expected<proto::scene::Image*> addImage(const std::string& name, const std::string& picture,
                                            const std::function<Expected<DecodedImage>()>& decode);
    /// Gives all images their pixels.
    void finish();

private:
    struct Picture {
        Expected<DecodedImage> decoded;
        std::vector<proto::scene::Image*> images;
    };
    /// False: none can be made smaller.
    bool halveLargest();

    PlainScene& scene_;
    const ReadLimits& limits_;
    std::map<std::string, Picture> pictures_;
    std::size_t bytes_ = 0;
    PixelPool pool_;
};

}  // namespace tessera
