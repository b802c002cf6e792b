function [files, options, clean] = recorded(given)
% RECORDED  The files that arguments mean: paths, or times and angles, which are written to a file for as long as CLEAN
% is kept.
  clean = [];
  if isnumeric(given{1})
    [time_s, angle_deg] = given{1:2};
    if numel(time_s) ~= numel(angle_deg)
      error('yawrig:refused', '%d times and %d angles', numel(time_s), numel(angle_deg));
    end
    file = [tempname(), '.csv'];
    clean = onCleanup(@() delete(file));
    out = fopen(file, 'w');
    fprintf(out, 'time_s,yaw_deg\n');
    fprintf(out, '%.17g,%.17g\n', [time_s(:)'; angle_deg(:)']);
    fclose(out);
    files = {file};
    options = given(3:end);
  else
    files = given{1};
    if ischar(files)
      files = {files};
    end
    options = given(2:end);
  end
end
