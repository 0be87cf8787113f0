// tessera-import: reads one file in confinement and writes what is in it to stdout, as server/import/Record.h says.
// Started by the importer, not by people.

#include "server/import/reader/ReadScene.h"
#include "server/import/reader/ReaderProgram.h"

int main(int count, char** values) {
    return tessera::runReaderProgram({.name = "tessera-import",
                                      .what = "scene or model file",
                                      .version = TESSERA_VERSION,
                                      .endings = tessera::allEndings,
                                      .read = tessera::readScene},
                                     count, values);
}
