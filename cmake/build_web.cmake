# SPDX-License-Identifier: Apache-2.0
# Builds the page: cmake -DNPM=npm -DSOURCE=clients/web -DWORK=folder -DOUTPUT=folder -P build_web.cmake
# Sources are copied to WORK, so the source tree stays clean; packages are fetched only when the lock file changed.
# WORK gets test/*.test.mjs, browser_test.mjs and rows_test.mjs besides; OUTPUT gets the page and nothing else.
foreach(name NPM SOURCE WORK OUTPUT)
  if(NOT ${name})
    message(FATAL_ERROR "build_web.cmake: -D${name}=... is missing")
  endif()
endforeach()

function(execute what)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK}/source RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "Web page: ${what} failed (${result})")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK}/source ${WORK}/test)
file(MAKE_DIRECTORY ${WORK}/source)
file(COPY ${SOURCE}/src ${SOURCE}/test ${SOURCE}/tsconfig.json DESTINATION ${WORK}/source)
file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json DESTINATION ${WORK})

# The stamp lies inside what it vouches for, and is written last: an interrupted fetch is repeated.
file(SHA256 ${SOURCE}/package-lock.json lock_hash)
set(stamp ${WORK}/node_modules/.lock-${lock_hash})
if(NOT EXISTS ${stamp})
  execute("npm ci" ${NPM} ci --prefix ${WORK} --ignore-scripts --no-audit --no-fund --prefer-offline)
  file(TOUCH ${stamp})
endif()

set(tools ${WORK}/node_modules/.bin)
execute("type check" ${tools}/tsc --project tsconfig.json)
execute("type check of tests" ${tools}/tsc --project test/tsconfig.json)

# Bundled aside and renamed file by file, so that a daemon that serves OUTPUT never sees half a page.
file(REMOVE_RECURSE ${WORK}/page)
execute("bundling" ${tools}/esbuild src/main.ts src/style.css --entry-names=[name] --bundle --minify --format=esm
  --target=es2022 --charset=utf8 --log-level=warning --outdir=${WORK}/page)
file(RENAME ${WORK}/page/main.js ${WORK}/page/app.js)
file(COPY ${SOURCE}/src/icon.svg DESTINATION ${WORK}/page)
file(READ ${SOURCE}/src/index.html html)
foreach(part sprite dialogs)
  file(READ ${SOURCE}/src/${part}.html text)
  string(REPLACE "  <!-- ${part} -->\n" "${text}" html "${html}")
endforeach()
file(WRITE ${WORK}/page/index.html "${html}")

file(GLOB tests ${WORK}/source/test/*.test.ts)
set(for_node --bundle --format=esm --platform=node --target=node18 --packages=external --sourcemap=inline
  --log-level=warning --out-extension:.js=.mjs "--define:PAGE_FOLDER=\"${OUTPUT}\"" "--define:SOURCE_FOLDER=\"${SOURCE}\"")
execute("bundling of tests" ${tools}/esbuild ${tests} ${for_node} --outdir=${WORK}/test)
execute("bundling of tests with a server" ${tools}/esbuild test/browser_test.ts test/rows_test.ts ${for_node} --outdir=${WORK})

file(MAKE_DIRECTORY ${OUTPUT})
foreach(name app.js style.css icon.svg index.html)
  file(RENAME ${WORK}/page/${name} ${OUTPUT}/${name})
endforeach()
file(TOUCH ${OUTPUT}/index.html)
