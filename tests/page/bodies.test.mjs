// The server's JSON bodies against the schemas of OGC API - Processes, and what the page sends
// against the schemas that the server publishes. No browser.
import assert from 'node:assert/strict';
import {existsSync, readFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, describe, it} from 'node:test';
import Ajv from 'ajv';
import addFormats from 'ajv-formats';
import {cull_inputs, horizon_inputs, sight_inputs, viewshed_inputs} from '../../cli/web/src/api.js';
import {DEFAULTS} from '../../cli/web/src/store.js';
import {SHARED, make_data, remove_folder, serve, temporary_folder} from './support/programs.mjs';

const STANDARD = join(SHARED, '../schemas/ogcapi-processes/ogcapi-processes.bundled.json');
const at = (lon, lat, height = '2') => ({lon, lat, height});
const STATES = [
  {...DEFAULTS, scene: 'jacksboro', eyes: [{...at(-84.2461, 36.5829), name: ''}]},
  {...DEFAULTS, scene: 'jacksboro', eyes: [{...at(-84.2461, 36.5829, '1200asl'), name: 'a'}, {...at(-84.2, 36.6), name: ''}], mode: 'count',
    min_distance_m: 100, target_height_m: 1.5, refraction: 0.13, azimuth_deg: [300, 120], pitch_deg: [-20, 20]},
];

function schemas() {
  const ajv = new Ajv({strict: false, allErrors: true});
  addFormats(ajv);
  return ajv;
}

describe('bodies', () => {
  let folder, server;
  before(async () => {
    folder = temporary_folder();
    make_data(folder);
    server = await serve(['jacksboro.tif', 'part.scene'], {cwd: folder});
  }, {timeout: 300_000});
  after(async () => {
    await server?.stop();
    remove_folder(folder);
  });
  const get = async (path, options) => {
    const response = await fetch(server.address + path, options);
    return {status: response.status, type: response.headers.get('content-type') ?? '', headers: response.headers, body: await response.json()};
  };
  const execute = (process, inputs, headers = {}, more = {}) => get(`/processes/${process}/execution`, {
    method: 'POST',
    headers: {'Content-Type': 'application/json', Accept: 'application/json', ...headers},
    body: typeof inputs === 'string' ? inputs : JSON.stringify({inputs, ...more}),
  });

  it('what the page sends is what the server publishes', async () => {
    const all = [
      ...STATES.map((state) => ['viewshed', viewshed_inputs(state)]),
      ['line-of-sight', sight_inputs({...STATES[0], from: at(-84.3, 36.55), to: at(-84.15, 36.62)})],
      ['horizon', horizon_inputs({...STATES[1], point: at(-84.3, 36.55)})],
      ['cull', cull_inputs({...DEFAULTS, scene: 'part', camera: at(-84.25, 36.59, '50'), heading_deg: 30})],
    ];
    for (const [process, inputs] of all) {
      const {body: described} = await get(`/processes/${process}`);
      const ajv = schemas();
      for (const [name, value] of Object.entries(inputs)) {
        const own = described.inputs[name];
        assert.ok(own, `${process} has no input '${name}'`);
        assert.ok(ajv.validate(own.schema, value), `${process}, ${name}: ${ajv.errorsText()}`);
      }
      for (const [name, {minOccurs = 1}] of Object.entries(described.inputs)) {
        if (minOccurs > 0) assert.ok(name in inputs, `${process} wants '${name}'`);
      }
      const {status, body} = await execute(process, inputs);
      assert.equal(status, 200, JSON.stringify(body));
      const [output] = Object.values(described.outputs);
      assert.ok(ajv.validate(output.schema, body), `${process}: ${ajv.errorsText()}`);
    }
  });

  describe('against the standard', {skip: existsSync(STANDARD) ? false : 'its schemas are not in the shared collection'}, () => {
    if (!existsSync(STANDARD)) return;
    const ajv = schemas();
    const standard = JSON.parse(readFileSync(STANDARD, 'utf8'));
    // What describes an input is any JSON schema; bundling put that of a feature's fields in its place.
    standard.components.schemas.schema = {type: 'object'};
    ajv.addSchema(standard, 'standard');
    const conforms = (schema, body) => {
      const good = ajv.validate({$ref: `standard#/components/schemas/${schema}`}, body);
      assert.ok(good, `${schema}: ${ajv.errorsText()} in ${JSON.stringify(body).slice(0, 400)}`);
    };
    // The collection's schema is the draft of version 2, which renamed two members of version 1 and
    // has a process by its address.
    const renamed = ({jobID, type, processID, ...info}) => {
      assert.equal(type, 'process');
      return {id: jobID, processingEntityType: 'ogc-api-processes', processID: `${server.address}/processes/${processID}`, ...info};
    };

    it('the landing page and what it conforms to', async () => {
      conforms('landingPage', (await get('/', {headers: {Accept: 'application/json'}})).body);
      const {body} = await get('/conformance');
      conforms('confClasses', body);
      assert.ok(body.conformsTo.includes('http://www.opengis.net/spec/ogcapi-processes-1/1.0/conf/core'));
    });

    it('processes', async () => {
      const {body} = await get('/processes');
      conforms('processList', body);
      assert.deepEqual(body.processes.map(({id}) => id).sort(), ['cull', 'echo', 'horizon', 'line-of-sight', 'viewshed']);
      for (const {id} of body.processes) {
        const {body: described} = await get(`/processes/${id}`);
        conforms('process', described);
        for (const {schema} of [...Object.values(described.inputs), ...Object.values(described.outputs)]) schemas().compile(schema);
      }
    });

    it('jobs, from accepted to dismissed', async () => {
      const {status, headers, body} = await execute('viewshed', viewshed_inputs(STATES[0]), {Prefer: 'respond-async'}, {response: 'document'});
      assert.equal(status, 201);
      conforms('statusInfo', renamed(body));
      const job = new URL(headers.get('location'), server.address).pathname;
      let info = body;
      for (let i = 0; i < 100 && !['successful', 'failed'].includes(info.status); ++i) {
        await new Promise((done) => setTimeout(done, 50));
        info = (await get(job)).body;
        conforms('statusInfo', renamed(info));
      }
      assert.equal(info.status, 'successful');
      const {body: list} = await get('/jobs');
      conforms('jobList', {...list, jobs: list.jobs.map(renamed)});
      conforms('results', (await get(`${job}/results`)).body);
      const dismissed = await get(job, {method: 'DELETE'});
      conforms('statusInfo', renamed(dismissed.body));
      assert.equal(dismissed.body.status, 'dismissed');
    });

    it('every refusal is an exception, in words', async () => {
      const good = viewshed_inputs(STATES[0]);
      const refused = [
        await get('/nowhere'), await get('/scenes/nowhere'), await get('/processes/nowhere'), await get('/jobs/nowhere'),
        await get('/scenes/jacksboro/height?at=north'), await get('/scenes/jacksboro/tiles/hillshade/99/0/0.png'),
        await execute('nowhere', good), await execute('viewshed', '{"inputs":'), await execute('viewshed', {}),
        await execute('viewshed', {...good, observers: []}), await execute('viewshed', {...good, observers: ['1,2,x']}),
        await execute('viewshed', {...good, observers: ['-70,36.5,2']}), await execute('viewshed', {...good, max_distance_m: -1}),
        await execute('viewshed', {...good, mode: 'all'}), await execute('cull', {scene: 'jacksboro', camera: '-84.2,36.6,50'}),
      ];
      for (const {status, type, body} of refused) {
        assert.ok(status >= 400 && status < 500, JSON.stringify(body));
        assert.match(type, /^application\/problem\+json/);
        conforms('exception', body);
        assert.equal(body.status, status);
        assert.ok(body.detail.length > 10, JSON.stringify(body));
      }
    });
  });
});
