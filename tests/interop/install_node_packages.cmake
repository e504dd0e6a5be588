# Installs into FOLDER, beside package-lock.json, the packages that it names: once, and again only
# when it has changed.
file(SHA256 ${FOLDER}/package-lock.json wanted)
if(EXISTS ${FOLDER}/node_modules/installed)
  file(READ ${FOLDER}/node_modules/installed installed)
  if(installed STREQUAL wanted)
    return()
  endif()
endif()
execute_process(COMMAND npm ci --ignore-scripts --no-audit --no-fund
  WORKING_DIRECTORY ${FOLDER} RESULT_VARIABLE failure)
if(failure)
  message(FATAL_ERROR "npm ci failed (${failure}). It needs node, npm and an npm registry; without "
    "one leave the tests of the Node client out: ./dev test -LE npm")
endif()
file(WRITE ${FOLDER}/node_modules/installed ${wanted})
