# find_package(Tessera) gives Tessera::application and the layers below it.
