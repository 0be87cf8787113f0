// tessera-import-coin: as tessera-import, for the files that Coin reads. A program of its own, as Coin brings the
// libraries of OpenGL and X11 along. Started by the importer, not by people.

#include "server/import/coin/CoinReader.h"
#include "server/import/reader/ReaderProgram.h"

int main(int count, char** values) {
    return tessera::runReaderProgram({.name = "tessera-import-coin",
                                      .what = "file of VRML, X3D or Inventor",
                                      .version = TESSERA_VERSION,
                                      .endings = tessera::coinEndings,
                                      .prepare = tessera::prepareCoin,
                                      .read = tessera::readWithCoin},
                                     count, values);
}
