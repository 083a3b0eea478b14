@echo off
rem Installs levilab on Windows for the person who runs it: without git, without administrator's rights.
rem
rem   install-levilab.cmd           install; offline if the folder wheelhouse lies beside this file
rem   install-levilab.cmd prepare   fill the folder wheelhouse, on a computer with a network
rem
rem Beside this file lie levilab-*.whl and constraints.txt. See docs/class.md.
setlocal
set "HOME_OF_IT=%LOCALAPPDATA%\levilab"
set "LAUNCHER=%LOCALAPPDATA%\Microsoft\WindowsApps\levilab.cmd"
pushd "%~dp0" || goto no_folder

set "WHEEL="
for %%F in (levilab-*.whl) do set "WHEEL=%%F"
if not defined WHEEL goto no_wheel

call :find_python
if defined PYTHON goto have_python
if exist wheelhouse goto no_python
echo Python 3.11 or newer is not on this computer: winget installs 3.12.
winget install --exact --id Python.Python.3.12 --scope user --accept-package-agreements --accept-source-agreements
call :find_python
if not defined PYTHON goto no_python

:have_python
if /i "%~1"=="prepare" goto prepare

echo Installing %WHEEL% into %HOME_OF_IT%: some 700 MB, a few minutes.
%PYTHON% -m venv --clear "%HOME_OF_IT%" || goto failed
set "FROM="
if exist wheelhouse set "FROM=--no-index --find-links wheelhouse"
"%HOME_OF_IT%\Scripts\python.exe" -m pip install --disable-pip-version-check %FROM% --constraint constraints.txt "%WHEEL%[live,pdf]" || goto failed
rem Python is signed, the levilab.exe that pip makes is not: some computers run the first alone.
>"%LAUNCHER%" echo @"%%LOCALAPPDATA%%\levilab\Scripts\python.exe" -m levilab %%*
call "%LAUNCHER%" --version || goto failed
echo Compiling the simulator for this processor: half a minute.
"%HOME_OF_IT%\Scripts\python.exe" -m levilab.world || goto failed
echo Done. Open a new terminal and type:  levilab live --mock
popd
exit /b 0

:prepare
%PYTHON% -m pip download --disable-pip-version-check --only-binary=:all: --dest wheelhouse --constraint constraints.txt "%WHEEL%[live,pdf]" || goto failed
echo Done. Copy this folder with wheelhouse to the other computers. They need the same Python as this one:
%PYTHON% --version
popd
exit /b 0

:find_python
set "PYTHON="
for %%P in ("py -3.12" "py -3" "python") do if not defined PYTHON (
  %%~P -c "import sys; sys.exit(sys.version_info < (3, 11))" >nul 2>nul && set "PYTHON=%%~P"
)
exit /b 0

:no_folder
echo %~dp0 cannot be opened: copy the folder with this file to this computer.
exit /b 1

:no_wheel
echo levilab-*.whl is not beside this file: unpack the whole zip first, then run this file in the new folder.
popd
exit /b 1

:no_python
echo Python 3.11 or newer is not on this computer: install it from python.org, without administrator's rights.
echo Offline: the same version as where the wheelhouse was prepared.
popd
exit /b 1

:failed
echo levilab is not installed: the message above says why. With a wheelhouse: is it for this Python?
popd
exit /b 1
