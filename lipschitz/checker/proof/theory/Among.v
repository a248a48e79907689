(** A bound in a box among a given number of neighbours, shown of phi and rho as one network, holds. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Coupled Claims Slopes Witness Laws Ranges Silent Relaxation Increments
      Signs
      Cover Everywhere.
Import ListNotations.
Open Scope R_scope.

(** Ranges by parts *)
Lemma all_before_hold ls lines before h x : lines_hold ls lines h -> h = reach before x -> valid before x ->
  valid (all_before ls lines before) x /\ reach (all_before ls lines before) x = through (relu_layers ls) h.
Proof.
  revert lines before h. induction ls as [|[w c] ls IH]; intros [|l lines] before h; simpl; try tauto;
    [intros _ -> V; auto|].
  intros [H G] -> V. apply (IH lines ((w, c, l) :: before) _ G); simpl; auto.
Qed.
Lemma ends_of_hold before w c b x : valid before x -> within b x -> length c = length w ->
  within (ends_of before w c b) (affine (realm w) (reals c) (reach before x)).
Proof.
  intros V W. revert c. induction w as [|row w IH]; intros [|a c]; simpl; try discriminate; auto.
  intros L. split; [|apply IH; lia]. rewrite real_neg.
  pose proof (most_above before [] row a b x V W) as U.
  pose proof (most_above before [] (map neg row) (neg a) b x V W) as M. rewrite dot_negated, real_neg in M. lra.
Qed.
Fixpoint known_ends (v : box) (y : list R) : Prop :=
  match v, y with i :: v', a :: y' => real (fst i) <= a <= real (snd i) /\ known_ends v' y' | _, _ => True end.
Lemma known_within v y : within v y -> known_ends v y.
Proof. revert y. induction v as [|[l h] v IH]; intros [|a y]; simpl; try tauto. intros [H G]. auto. Qed.
Lemma narrowed_within e v y : known_ends e y -> within v y -> within (narrowed e v) y.
Proof.
  revert v y. induction e as [|[l h] e IH]; intros [|[l' h'] v] [|a y]; simpl; try tauto.
  intros [K1 K2] [W1 W2]. split; [|auto]. split; [apply larger_least; lra|]. destruct (at_most h h'); lra.
Qed.
Lemma check_range_sound o ls last b around e v t x : Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  length (snd last) = length (fst last) -> check_range o ls last b around e v t = true -> within b x ->
  known ls around x -> let y := network (relu_layers ls) (real_layer last) x in known_ends e y -> within v y.
Proof.
  intros F Fl. revert b around e. induction t as [ds|ds k m lower IHl upper IHu]; intros b around e; simpl;
    destruct (bounds o b [] ls around ds) as [lines|] eqn:B; try discriminate; intros H W K E;
    pose proof (bounds_hold o b x W ls around ds lines F K B) as L;
    destruct (all_before_hold ls lines [] x x L eq_refl I) as [V R];
    pose proof (ends_of_hold (all_before ls lines []) (fst last) (snd last) b x V W Fl) as N; rewrite R in N;
    rewrite network_end in *; apply (narrowed_within e _ _ E) in N.
  - eapply contains_within; [exact H|exact N].
  - both H. apply known_within in N. destruct (Rle_dec (nth k x 0) (real m)).
    + eapply IHl; [exact H|now apply within_cut|now apply known_of|exact N].
    + eapply IHu; [exact H0|apply within_cut; auto; simpl; lra|now apply known_of|exact N].
Qed.

(** V (W h + b) = (V W) h + V b. *)
Lemma affine_joined (phi rho : layerD) h : length (hd [] (fst phi)) = length h ->
  affine (realm (fst (joined_layer phi rho))) (reals (snd (joined_layer phi rho))) h =
  affine (realm (fst rho)) (reals (snd rho)) (affine (realm (fst phi)) (reals (snd phi)) h).
Proof.
  intros L. unfold joined_layer. simpl fst. simpl snd. unfold affine.
  rewrite (f_product zero add mul 0 Rplus Rmult real real_zero real_add real_mul).
  rewrite (f_plus add Rplus real real_add), (f_apply zero add mul 0 Rplus Rmult real real_zero real_add real_mul).
  rewrite apply_product by (rewrite <- L; destruct (fst phi); simpl; now rewrite ?map_length).
  now rewrite apply_plus, plus_assoc.
Qed.
Lemma outputs_through ls n z : Forall (fun l : layerD => length (snd l) = length (fst l)) ls -> length z = n ->
  length (through (relu_layers ls) z) = outputs (map fst ls) n.
Proof.
  intros F L. assert (Forall (fun k => bias_fits (snd k)) (relu_layers ls)) as B.
  { unfold relu_layers. apply Forall_map. eapply Forall_impl; [|exact F]. intros l E. unfold bias_fits. simpl.
    now rewrite !map_length. }
  assert (Forall (fun k => keeps_length (fst k)) (relu_layers ls)) as K
    by (unfold relu_layers; apply Forall_map, Forall_forall; intros l _ y; apply map_length).
  rewrite (length_through _ z B K n L). unfold outputs, relu_layers. rewrite map_map. clear.
  generalize (repeat (@nil R) n), (repeat (@nil dyadic) n), (eq_trans (repeat_length (@nil R) n)
    (eq_sym (repeat_length (@nil dyadic) n))).
  intros e d E. induction ls as [|l ls IH]; auto. destruct ls; [|exact IH]. simpl. apply map_length.
Qed.
Lemma fits_hidden p : fits_part p = true -> Forall (fun l : layerD => length (snd l) = length (fst l)) (hidden p).
Proof. intros H. apply Forall_forall. intros l G. apply (fits_layer p); auto. apply in_or_app. now left. Qed.
Lemma plus_no_bias u (w : matrixD) : length u = length w -> plusR u (reals (map (fun _ => zero) w)) = u.
Proof.
  revert w. induction u as [|a u IH]; intros [|r w]; simpl; try discriminate; auto. intros L. rewrite real_zero, IH
    by lia.
  f_equal. ring.
Qed.
Definition first_matrix (g : part) := realm (fst (first_layer g)).
Lemma term_value p g x : fits_part p = true -> relu_between p = true -> joins p (length x) = true ->
  network (relu_layers (hidden p)) (real_layer (term_layer p g)) (clamped (clamp p) x) =
    applyR (first_matrix g) (value p x).
Proof.
  intros F R J. unfold value. rewrite relu_network by auto. rewrite !network_end. apply Nat.eqb_eq in J.
  set (h := through (relu_layers (hidden p)) (clamped (clamp p) x)).
  assert (length h = outputs (map fst (hidden p)) (length x)) as L.
  { apply outputs_through; [now apply fits_hidden|apply length_clamped]. }
  change (affine (realm (fst (term_layer p g))) (reals (snd (term_layer p g))) h =
    applyR (first_matrix g) (affine (realm (fst (outer p))) (reals (snd (outer p))) h)).
  unfold term_layer. rewrite affine_joined by congruence. unfold affine at 1. simpl.
  rewrite plus_no_bias; auto. unfold first_matrix, apply. now rewrite !map_length.
Qed.

(** What the other terms add *)
Lemma apply_vector_sum m us : applyR m (vector_sum us) = plusR (vector_sum (map (applyR m) us)) (zeros (length m)).
Proof.
  induction us as [|u us IH]; simpl.
  - unfold zeros. induction m as [|r m IH]; simpl; auto. f_equal; auto. apply dot_nil_r.
  - now rewrite apply_plus, IH, plus_assoc.
Qed.
Lemma length_ends_of_terms m others vs s : ends_of_terms m others vs = Some s -> length s = m.
Proof.
  revert vs s. induction others as [|[p b low high] others IH]; intros [|v vs] s; simpl; try discriminate.
  - intros H. inversion H. apply repeat_length.
  - destruct (ends_of_terms m others vs) as [z|] eqn:E; [|discriminate]. specialize (IH _ _ E).
    destruct (_ && _)%bool eqn:C; [|discriminate]. intros H. inversion H. do 2 both C. apply Nat.eqb_eq in C.
    rewrite length_add_ends; congruence.
Qed.
Lemma term_range_sound ps rho o t v xs : check_term_range ps rho o t v = true ->
  Forall (within (inputs_in t)) xs -> Forall (within (fst v)) (map (applyR (first_matrix (part_at ps rho)))
    (map (value (part_at ps (phi t))) xs)).
Proof.
  unfold check_term_range. intros H F. do 3 both H. rewrite map_map. apply Forall_map.
  eapply Forall_impl; [|exact F]. intros x W. simpl. rewrite <- term_value; auto.
  - eapply check_range_sound; [now apply fits_hidden| |exact H0|now apply within_clamped|apply known_nothing|exact I].
    unfold term_layer, joined_layer, product. simpl. rewrite map_length.
    rewrite <- (map_length real), (f_plus add Rplus real real_add), length_plus; unfold apply; now rewrite !map_length.
  - now rewrite (within_length _ _ W).
Qed.
Lemma ends_of_terms_sound ps rho o others vs s inputs : let m := length (fst (first_layer (part_at ps rho))) in
  check_term_ranges ps rho o others vs = true -> ends_of_terms m others (map fst vs) = Some s ->
  Forall2 may_stand others inputs ->
  within s (applyR (first_matrix (part_at ps rho)) (vector_sum (flat_map
    (fun t => map (value (part_at ps (phi (fst t)))) (snd t)) (combine others inputs)))).
Proof.
  intros m. rewrite apply_vector_sum. unfold first_matrix at 2. rewrite map_length. fold m.
  revert vs s inputs. induction others as [|t others IH]; intros [|v vs] s inputs; simpl; try discriminate.
  - intros _ H M. inversion H. simpl. apply zeros_within.
  - intros H. both H. destruct t as [p b low high].
    destruct (ends_of_terms m others (map fst vs)) as [z|] eqn:E; [|discriminate].
    destruct (_ && _)%bool eqn:C; [|discriminate]. intros G M. inversion G. subst s. clear G.
    inversion M as [|? xs ? inputs' [K F] M']; subst. specialize (IH _ _ _ H0 E M'). do 2 both C.
    apply Nat.eqb_eq in C. pose proof (length_ends_of_terms _ _ _ _ E) as Lz.
    pose proof (term_range_sound _ _ _ _ _ _ H F) as W. simpl in W, K, F. simpl flat_map.
    destruct (sum_within (fst v) _ W) as (y & T & L & S). rewrite !map_length in T.
    rewrite map_app, vector_sum_app, plus_assoc. pose proof (within_length _ _ IH) as Lw.
    rewrite S by congruence. apply add_ends_within with (k := INR (length xs)); auto; [|congruence].
    rewrite INR_IZR_INZ. split; apply IZR_le; lia.
Qed.

(** phi with the inputs that pass through *)
Lemma units_of k pre r : length pre = k ->
  map (fun row => dotR (reals row) (pre ++ r)) (map (fun i => unit_form (k + i)) (seq 0 (length r))) = r.
Proof.
  revert k pre. induction r as [|a r IH]; intros k pre L; simpl; auto. f_equal.
  - rewrite Nat.add_0_r. now apply dot_unit.
  - rewrite <- (IH (S k) (pre ++ [a])) at 2 by (rewrite app_length; simpl; lia). rewrite <- app_assoc. simpl.
    rewrite <- seq_shift, !map_map. apply map_ext. intros i. now rewrite Nat.add_succ_r.
Qed.
Lemma affine_padded w c x r : Forall (fun row : list dyadic => length row = length x) w ->
  affine (realm (map (fun row => row ++ repeat zero (length r)) w)) (reals c) (x ++ r) =
    affine (realm w) (reals c) x.
Proof.
  intros F. unfold affine. f_equal. unfold apply. induction F as [|row w L F IH]; simpl; auto. f_equal; auto.
  rewrite map_app, dot_app by now rewrite map_length. rewrite real_zeros, dot_zeros. ring.
Qed.
Lemma passing_through ls x r n : is_chain n ls = true -> length x = n -> Forall (fun a => 0 <= a) r ->
  Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  through (relu_layers (passing n (length r) ls)) (x ++ r) = through (relu_layers ls) x ++ r.
Proof.
  intros C L P F. revert n x C L. induction F as [|[w c] ls Hc F IH]; intros n x C L; simpl; auto.
  simpl in Hc, C. apply andb_prop in C. destruct C as [Cw C]. apply is_chain_rows in Cw. subst n.
  assert (map relu r = r) as Hr
    by (clear - P; induction P as [|a r H P IH]; simpl; [|rewrite relu_right, IH by auto]; auto).
  unfold through at 1. simpl fold_left. rewrite affine_app by now rewrite map_length.
  rewrite affine_padded by auto.
  assert (affine (realm (map (fun i => unit_form (length x + i)) (seq 0 (length r)))) (reals (repeat zero (length r)))
    (x ++ r) = r) as E.
  { unfold affine, apply. rewrite map_map. rewrite units_of by auto. rewrite real_zeros. clear.
    induction r as [|a r IH]; simpl; auto. rewrite IH. f_equal. ring. }
  rewrite E, map_app, Hr. apply IH; auto. rewrite map_length, length_affine; now rewrite ?map_length.
Qed.

(** phi, the rest and rho as one network *)
Lemma apply_with_units w h k pre r : Forall (fun row : list dyadic => length row = length h) w -> length r = length w ->
  length pre = k -> applyR (realm (with_units w k)) (h ++ pre ++ r) = plusR (applyR (realm w) h) r.
Proof.
  intros F. revert k pre r. induction F as [|row w L F IH]; intros k pre [|a r]; simpl; try discriminate; auto.
  intros Lr Lp. f_equal.
  - rewrite map_app, dot_app by now rewrite map_length. now rewrite dot_unit.
  - rewrite <- (IH (S k) (pre ++ [a]) r) by (rewrite ?app_length; simpl; lia). now rewrite <- app_assoc.
Qed.
Lemma plus_back u v : length u = length v -> plusR (minus u v) v = u.
Proof.
  unfold minus. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; auto.
  intros L. rewrite IH by lia. f_equal. ring.
Qed.
Lemma affine_coupled (phi rho : layerD) h rest least :
  length (hd [] (fst phi)) = length h -> length least = length (fst rho) ->
  let r := minus (applyR (realm (fst rho)) rest) (reals least) in let j := joined_layer phi rho in
  affine (realm (with_units (fst j) O)) (reals (plus add (snd j) least)) (h ++ r) =
    affine (realm (fst rho)) (reals (snd rho)) (plusR (affine (realm (fst phi)) (reals (snd phi)) h) rest).
Proof.
  intros L M r j. assert (length (applyR (realm (fst rho)) rest) = length (reals least)) as Q
    by (unfold apply; rewrite !map_length; congruence).
  assert (length r = length (fst j)) as Lr.
  { unfold r, j, joined_layer. simpl. rewrite length_minus by congruence. unfold product. rewrite map_length.
    unfold apply. now rewrite !map_length. }
  assert (Forall (fun row => length row = length h) (fst j)) as F.
  { unfold j, joined_layer, product. simpl. apply Forall_map, Forall_forall. intros row _. unfold apply.
    rewrite map_length, <- L. generalize (fst phi) at 2 as m. clear.
    induction (length (hd [] (fst phi))) as [|n IH]; intros m; simpl; auto. }
  pose proof (affine_joined phi rho h L) as A. fold j in A. unfold affine at 1 in A. unfold affine at 1.
  rewrite (f_plus add Rplus real real_add). pose proof (apply_with_units (fst j) h O [] r F Lr eq_refl) as U.
  change ([] ++ r) with r in U. rewrite U. pose proof (plus_back _ _ Q) as B. fold r in B.
  rewrite plus_assoc, (plus_comm r), !plus_assoc, (plus_comm (reals least)), B, <- plus_assoc, A.
  unfold affine at 1 3. rewrite apply_plus, !plus_assoc. f_equal. apply plus_comm.
Qed.
Lemma clamped_app c x r : (length c <= length x)%nat -> clamped c (x ++ r) = clamped c x ++ r.
Proof.
  revert x. induction c as [|[l h] c IH]; intros [|a x]; simpl; auto; try lia; try (intros; f_equal; apply IH; lia).
Qed.
Lemma coupled_value f g x rest least : fits_part f = true -> relu_between f = true -> fits_part g = true ->
  relu_between g = true -> clamp g = [] -> hidden g <> [] -> (length (clamp f) <= length x)%nat ->
  joins f (length x) = true -> is_chain (length x) (hidden f) = true -> length x = inputs_of f ->
  length least = length (fst (first_layer g)) ->
  let r := minus (applyR (first_matrix g) rest) (reals least) in Forall (fun a => 0 <= a) r ->
  value (coupled f g least) (x ++ r) = value g (plusR (value f x) rest).
Proof.
  intros Ff Rf Fg Rg Cg Hg Lc J C Lx Ll r P. unfold coupled.
  set (j := joined_layer (outer f) (first_layer g)). destruct j as [w c] eqn:Ej.
  unfold value. rewrite !relu_network by auto. rewrite Cg. simpl hidden. simpl outer. simpl clamp.
  rewrite clamped_app by auto. set (z := clamped (clamp f) x). assert (length z = length x) as Lz by apply
    length_clamped.
  assert (length w = length r) as Lw.
  { assert (w = fst j) as -> by now rewrite Ej. unfold j, joined_layer, product, r. simpl.
    assert (length (applyR (first_matrix g) rest) = length (fst (first_layer g))) as Q
      by (unfold first_matrix, apply; now rewrite !map_length).
    rewrite map_length, length_minus; rewrite ?map_length; congruence. }
  unfold relu_layers at 1. rewrite map_app, network_app. fold (relu_layers (passing (inputs_of f) (length w) (hidden
    f))).
  rewrite Lw, passing_through by (auto using fits_hidden; congruence).
  set (h := through (relu_layers (hidden f)) z). rewrite (network_end (relu_layers (hidden f))).
  destruct g as [[|[V b] later] last clampg act] eqn:Eg; [now destruct Hg|]. simpl hidden. simpl outer. simpl tl.
  unfold relu_layers at 1. simpl map. simpl network. f_equal. f_equal.
  assert (length (hd [] (fst (outer f))) = length h) as L.
  { apply Nat.eqb_eq in J. rewrite J. symmetry. apply outputs_through; [now apply fits_hidden|exact Lz]. }
  pose proof (affine_coupled (outer f) (V, b) h rest least L Ll) as A. simpl first_layer in *.
  change (joined_layer (outer f) (V, b)) with j in A. rewrite Ej in A. simpl fst in A. simpl snd in A. exact A.
Qed.
Lemma agree_more moves x y r : agree moves x y -> agree (moves ++ repeat false (length r)) (x ++ r) (y ++ r).
Proof.
  revert x y. induction moves as [|m moves IH]; intros [|a x] [|b y]; simpl; try tauto.
  - intros _. induction r; simpl; auto.
  - intros [H G]. split; auto.
Qed.
Lemma distance_more scale x y r : length x = length y -> (scale = [] \/ length scale = length x) ->
  distance (if is_nil scale then [] else scale ++ repeat one (length r)) (x ++ r) (y ++ r) = distance scale x y.
Proof.
  intros L H. unfold distance. f_equal.
  assert (forall s : list dyadic, square_in s (minus r r) = 0) as Z.
  { unfold minus. induction r as [|a r IH]; intros s; simpl; auto. rewrite IH. replace (a + -1 * a) with 0 by ring.
    unfold Rdiv. ring. }
  assert (minus (x ++ r) (y ++ r) = minus x y ++ minus r r) as ->.
  { unfold minus. clear H Z. revert y L. induction x as [|a x IH]; intros [|b y] L; simpl in *; try discriminate; auto.
    f_equal. apply IH. lia. }
  pose proof (length_minus x y ltac:(congruence)) as Lm. destruct H as [->|H].
  - simpl. clear - Z. induction (minus x y) as [|a u IH]; simpl; auto. now rewrite IH.
  - destruct scale as [|s scale]; [simpl|change (is_nil (s :: scale)) with false; cbv iota].
    + destruct x; [|discriminate]. destruct y; [|discriminate]. simpl. apply Z.
    + rewrite <- Lm in H. revert H. generalize (s :: scale) as t. clear - Z. induction (minus x y) as [|a u IH].
      * intros [|? ?]; [|discriminate]. intros _. simpl. apply Z.
      * intros [|b t]; [discriminate|]. simpl. intros H. rewrite IH; auto.
Qed.
Lemma within_more b x s v : within b x -> within s v ->
  within (b ++ map (fun i => (zero, add (snd i) (neg (fst i)))) s) (x ++ minus v (reals (map fst s))).
Proof.
  revert x. induction b as [|[l h] b IH]; intros [|a x]; simpl; try tauto.
  - intros _ H. unfold minus. revert v H. induction s as [|[l h] s IH]; intros [|c v]; simpl; try tauto. intros [H G].
    split; [|now apply IH]. rewrite real_zero, real_add, real_neg. lra.
  - intros [H G] Hs. split; auto.
Qed.
Lemma above_least s v : within s v -> Forall (fun a => 0 <= a) (minus v (reals (map fst s))).
Proof.
  unfold minus. revert v. induction s as [|[l h] s IH]; intros [|c v]; simpl; try tauto; [constructor|].
  intros [H G]. constructor; [lra|now apply IH].
Qed.
Lemma slope_among_sound ps p rho moves scale b others u r o ranges t :
  check_slope_among ps p rho moves scale b others u r o ranges t = true ->
  holds ps (Slope_among p rho moves scale b others u).
Proof.
  unfold check_slope_among. set (f := part_at ps p). set (g := part_at ps rho). cbv zeta. intros H inputs x y M A _
    Wx Wy.
  cbv zeta. set (rest := vector_sum _). do 12 both H.
  rename H0 into HT, H1 into Hr, H2 into Hm, H3 into Hg, H4 into Hc, H5 into Rg, H6 into Fg, H7 into Ch, H8 into Hf,
    H9 into J, H10 into Lc, H11 into Rf.
  destruct (ends_of_terms _ _ _) as [s|] eqn:Es; [|discriminate].
  apply Nat.eqb_eq in Hm. apply Nat.leb_le in Lc. destruct (agree_lengths _ _ _ A) as [Lx Ly].
  pose proof (ends_of_terms_sound ps rho o others ranges s inputs Hr Es M) as W. fold g rest in W.
  pose proof (length_ends_of_terms _ _ _ _ Es) as Ls.
  assert (hidden g <> []) as Hg' by (destruct (hidden g); [discriminate|congruence]).
  assert (clamp g = []) as Cg by (destruct (clamp g); [auto|discriminate]).
  set (q := minus (applyR (first_matrix g) rest) (reals (map fst s))).
  assert (length q = length (fst (first_layer g))) as Lq.
  { unfold q. pose proof (within_length _ _ W) as Lw. rewrite length_minus; rewrite ?map_length; congruence. }
  assert (forall z, length z = inputs_of f -> value (coupled f g (map fst s)) (z ++ q) =
    value_of ps (Set_of p rho) rest z) as V.
  { intros z Lz. simpl value_of. fold f g. apply coupled_value; auto; try (rewrite Lz; auto); try congruence.
    - rewrite map_length. exact Ls.
    - now apply above_least. }
  rewrite <- !V by congruence. rewrite <- Lq in HT.
  assert ((scale = [] \/ length scale = length x) /\
    length (x ++ q) = inputs_of (part_at [coupled f g (map fst s)] (moved (Alone 0)))) as [Hs Lxq].
  { pose proof HT as K. unfold check_parts_of_box, check_parts_with, well_formed in K. do 4 both K. do 4 both K.
    repeat match goal with E : (length (moves ++ _) =? _)%nat = true |- _ => apply Nat.eqb_eq in E end.
    rewrite !app_length, !repeat_length in *. split; [|congruence].
    destruct scale as [|a scale]; [now left|right].
    match goal with E : (is_nil _ || _)%bool = true |- _ => apply orb_prop in E; destruct E as [E|E];
      [discriminate|]; apply Nat.eqb_eq in E; change (is_nil (a :: scale)) with false in E; cbv iota in E;
      rewrite !app_length, !repeat_length in E; lia end. }
  rewrite <- (distance_more scale x y q) by (auto; congruence).
  apply slope_in_box_sound in HT. apply (HT []).
  - now apply agree_more.
  - exact Lxq.
  - now apply within_more.
  - now apply within_more.
Qed.
