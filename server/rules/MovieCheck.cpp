#include "server/rules/MovieCheck.h"

#include <fmt/format.h>

#include <map>
#include <unordered_map>
#include <unordered_set>

#include "common/cores/Movie.h"
#include "common/scene/FieldTable.h"

namespace tessera {

Sound checkMovies(const Aspect& scene, const ChangeList& list, const std::set<ObjectId>& movies) {
    std::map<ObjectId, ObjectId> said;
    const FieldEntry& field = *findField(*findType(typeOf<Movie>()), fieldId<&Movie::image>);
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Movie>() || column.field != field.id || column.kind() != field.kind ||
            column.scalarCount() != column.ids.size())
            continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            said[column.ids[row]] = std::get<ObjectId>(column.value(row));
    }
    const std::unordered_set<ObjectId> gone(list.destructions.begin(), list.destructions.end());
    std::unordered_map<ObjectId, ObjectId> writers;  // of images
    for (const auto& [movie, image] : said) {
        if (!image || gone.contains(movie)) continue;
        if (!writers.emplace(image, movie).second)
            return tl::unexpected(
                Fault{movie, typeOf<Movie>(), {ErrorCode::kRefused, "its image: another Movie writes it too"}});
    }
    if (writers.empty()) return {};
    for (const ObjectId id : movies) {
        const Movie* movie = scene.get<Movie>(id);
        if (!movie || said.contains(id) || gone.contains(id)) continue;
        if (const auto other = writers.find(movie->image); other != writers.end())
            return tl::unexpected(
                Fault{other->second,
                      typeOf<Movie>(),
                      {ErrorCode::kRefused, fmt::format("its image: Movie #{} writes it already", id.value)}});
    }
    return {};
}

}  // namespace tessera
